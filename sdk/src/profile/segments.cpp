// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <striper/profile/segments.hpp>

#include "profile/cutter.hpp"
#include "profile/scan_line.hpp"
#include "profile/surface_edge.hpp"

namespace striper {
namespace {

// What a variance of its own has to gain for a piece, besides the piece's penalty: one scan of a
// straight line in 1e5 is called rough (chi2 of one degree of freedom beyond 20).
constexpr double kRoughPenalty = 20.0;

// Of a circle where its outermost return is on it.
detail::SurfaceEdge edge_of(const detail::InverseRanges& ranges, const detail::Run& run,
                            bool is_end) noexcept {
  if (!run.is_circular) return detail::edge_beyond(ranges, run.fit, run.from, run.to, is_end);
  const std::size_t outer = is_end ? run.to - 1 : run.from;
  detail::SurfaceEdge edge;
  edge.direction = {ranges.cosine[outer], ranges.sine[outer]};
  edge.q = detail::on_circle(ranges, outer, run.circle).q;
  edge.at_m = ranges.pivot + edge.direction / edge.q;
  edge.sigma_m = Piece::kNone;
  return edge;
}

}  // namespace

struct Segmenter::Impl {
  SegmentOptions options;
  detail::Cutter cutter;
};

Segmenter::Segmenter(const SegmentOptions& options) : impl_(std::make_unique<Impl>()) {
  options.validate();
  impl_->options = options;
}
Segmenter::Segmenter(Segmenter&&) noexcept = default;
Segmenter& Segmenter::operator=(Segmenter&&) noexcept = default;
Segmenter::~Segmenter() = default;

const SegmentOptions& Segmenter::options() const noexcept { return impl_->options; }

void Segmenter::segment(const PolarScan& scan, Segmentation& out) {
  impl_->cutter.cut(scan, impl_->options, out);
}

namespace detail {

void Cutter::cut(const PolarScan& scan, const SegmentOptions& options, Segmentation& out) {
  ranges.take(scan, options.pivot_m);
  with_speckle_.reserve(scan.returns.size());
  leave_out_part_seen(out);
  out.texture_m = options.estimate_texture ? texture_.estimate_m(ranges) : 0.0;
  const bool is_textured = out.texture_m > 0.0;
  if (is_textured) texture_.apply(out.texture_m, ranges);
  leave_out_speckle(out);
  if (is_textured) {  // Speckle made it look rougher.
    out.texture_m = texture_.estimate_m(ranges);
    texture_.apply(out.texture_m, ranges);
    weigh_with_speckle();
  }
  out.penalty = piece_penalty(options.false_split_rate, ranges.size());
  take_runs(partition_.cut(ranges, {out.penalty, kRoughPenalty}));
  for (Run& run : runs) judge_roughness(run, kRoughPenalty);
  if (options.find_circles) {
    const double bend = bend_penalty(options.false_split_rate);
    circles_.join(ranges, {out.penalty, bend, kRoughPenalty}, runs);
  }
  join_blurred_corners();
  const auto is_plain = [](const Run& run) { return !run.is_rough && !run.is_circular; };
  for (std::size_t k = 0; k + 1 < runs.size(); ++k) {
    runs[k].meets_next =
        is_plain(runs[k]) && is_plain(runs[k + 1]) && corners_.settle(ranges, runs[k], runs[k + 1]);
  }
  report_pieces(scan, out);
  report_joints(out);
}

void Cutter::note_outliers(const std::vector<char>& marked, Segmentation& out) const {
  for (std::size_t i = 0; i < ranges.size(); ++i)
    if (marked[i]) out.outliers.push_back(ranges.index[i]);
}

void Cutter::leave_out_part_seen(Segmentation& out) {
  const std::vector<char>& marked = edges_.mark(ranges);
  out.outliers.clear();
  note_outliers(marked, out);
  if (!out.outliers.empty()) ranges.remove_part_seen(marked);
}

void Cutter::leave_out_speckle(Segmentation& out) {
  const std::size_t before = out.outliers.size();
  const std::vector<char>& marked = gate_.mark(ranges);
  note_outliers(marked, out);
  has_speckle_ = out.outliers.size() > before;
  if (!has_speckle_) return;
  with_speckle_ = ranges;
  ranges.remove_marked(marked);
  std::sort(out.outliers.begin(), out.outliers.end());
}

void Cutter::weigh_with_speckle() {
  if (!has_speckle_) return;
  std::size_t all = 0;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    while (with_speckle_.index[all] != ranges.index[i]) ++all;
    with_speckle_.weight[all] = ranges.weight[i];
  }
}

void Cutter::take_runs(const std::vector<std::size_t>& cuts) {
  runs.clear();
  for (std::size_t k = 0; k < cuts.size(); ++k) {
    const std::size_t to = k + 1 < cuts.size() ? cuts[k + 1] : ranges.size();
    Run& run = runs.emplace_back();
    run.from = cuts[k];
    run.to = to;
    run.fit = fit_run(ranges, cuts[k], to);
  }
}

// The search for the corner shares the columns out.
void Cutter::join_blurred_corners() {
  for (std::size_t k = 1; k + 1 < runs.size(); ++k) {
    if (!is_blurred_corner(ranges, runs[k - 1], runs[k], runs[k + 1])) continue;
    runs[k - 1].to = runs[k].to;
    runs[k - 1].fit = fit_run(ranges, runs[k - 1]);
    runs.erase(runs.begin() + static_cast<std::ptrdiff_t>(k));
  }
}

// By the same rule as the partition's costs.
void Cutter::judge_roughness(Run& run, double penalty) {
  const auto m = static_cast<double>(run.to - run.from);
  const double ratio = run.fit.chi2 / m;
  run.is_rough =
      m >= kFewestOfRough && ratio > 1.0 && run.fit.chi2 - m - m * std::log(ratio) > penalty;
  if (run.is_rough) run.scale = std::sqrt(run.fit.chi2 / run.fit.dof());
}

void Cutter::report_pieces(const PolarScan& scan, Segmentation& out) const {
  out.pieces.resize(runs.size());
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const Run& run = runs[k];
    Piece& piece = out.pieces[k] = Piece{};
    piece.is_rough = run.is_rough;
    piece.first = ranges.index[run.from];
    piece.last = ranges.index[run.to - 1];
    piece.points = static_cast<int>(run.to - run.from);
    piece.line = scan_line(run.fit, run.scale, ranges.pivot);
    piece.chi2 = run.fit.chi2;
    piece.dof = run.fit.dof();
    piece.scale = run.scale;
    if (run.is_circular) {
      piece.chi2 = run.circle.chi2;
      piece.dof = run.circle.dof();
      piece.circle = ScanCircle{run.circle.centre_m, run.circle.radius_m, run.circle.is_hollow,
                                run.circle.covariance};
    }
    const SurfaceEdge begin = edge_of(ranges, run, false);
    const SurfaceEdge end = edge_of(ranges, run, true);
    piece.begin_m = begin.at_m;
    piece.sigma_begin_m = begin.sigma_m;
    piece.end_m = end.at_m;
    piece.sigma_end_m = end.sigma_m;
    piece.is_begin_seen = piece.first > 0;
    piece.is_end_seen = piece.last + 1 < scan.returns.size();
  }
}

void Cutter::report_joints(Segmentation& out) const {
  out.joints.resize(runs.empty() ? 0 : runs.size() - 1);
  for (std::size_t k = 0; k < out.joints.size(); ++k) {
    Joint& joint = out.joints[k] = Joint{};
    Piece& left = out.pieces[k];
    Piece& right = out.pieces[k + 1];
    const LineFit both = fit_run(ranges, runs[k].from, runs[k + 1].to);
    joint.evidence = both.chi2 - left.chi2 - right.chi2;
    for (Piece* piece : {&left, &right})
      piece->evidence = std::fmin(piece->evidence, joint.evidence);
    if (!runs[k].meets_next) continue;
    const Meeting meeting = meet_at_knot(ranges, runs[k], runs[k + 1]);
    joint.kind = JointKind::kCorner;
    joint.corner_m = ranges.pivot + meeting.point_m;
    joint.covariance = meeting.covariance;
    left.end_m = right.begin_m = joint.corner_m;
    const Eigen::Vector2d along = left.line.direction();
    left.sigma_end_m = std::sqrt(along.dot(meeting.covariance * along));
    const Eigen::Vector2d other = right.line.direction();
    right.sigma_begin_m = std::sqrt(other.dot(meeting.covariance * other));
  }
}

}  // namespace detail

void mark_outliers(const Segmentation& segmentation, PolarScan& scan) {
  for (const std::size_t i : segmentation.outliers) scan.returns[i].status = ReturnStatus::kOutlier;
}

}  // namespace striper
