// SPDX-License-Identifier: Apache-2.0
#include "profile/tools/patch.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/LU>

#include "profile/partition.hpp"
#include "profile/scan_line.hpp"
#include "profile/tools/tool_rows.hpp"

namespace striper::detail {
namespace {

// A piece is its surface where it is so much of it: a rounded end is left out, a bend is not.
constexpr double kNearlyAll = 0.8;
// A second surface with more than this part of the first's returns may be the one that is meant.
constexpr double kRival = 0.5;
// -2 log likelihood of a scatter of its own; as for rough pieces (segments.cpp).
constexpr double kScatterPenalty = 20.0;
// Pieces that are less than this apart where they touch, sigmas of one return, may be one curved
// surface: a parabola cut where it must be (penalty 25) is 5 off at the cut.
constexpr double kMostOfCurve = 8.0;

bool may_go_on(const InverseRanges& ranges, const Run& left, const Run& right) {
  const Eigen::Vector2d v(ranges.cosine[right.from], ranges.sine[right.from]);
  const double jump = (left.fit.parameters - right.fit.parameters).dot(v);
  return left.meets_next || jump * jump * ranges.weight[right.from] < kMostOfCurve * kMostOfCurve;
}

// Whether an element sees both sides of a corner.
bool is_mixed(const Run& run, std::size_t i) noexcept {
  return i < run.from + run.mixed_at_begin || i + run.mixed_at_end >= run.to;
}

}  // namespace

double scatter_scale(double chi2, int dof) noexcept {
  const auto m = static_cast<double>(dof);
  if (!(dof > 0) || !(chi2 > m)) return 1.0;
  const bool is_chance = chi2 - m - m * std::log(chi2 / m) < kScatterPenalty;
  return is_chance ? 1.0 : std::sqrt(chi2 / m);
}

PatchLine fit_patch(const InverseRanges& ranges, std::span<const std::size_t> elements) {
  PatchLine line;
  line.fit = fit_elements(ranges, elements);
  line.scale = scatter_scale(line.fit.chi2, line.fit.dof());
  line.line = scan_line(line.fit, line.scale, ranges.pivot);
  return line;
}

Eigen::Matrix2d PatchEnd::by_line() const noexcept {
  if (!(q > 0.0)) return Eigen::Matrix2d::Zero();
  return -direction * direction.transpose() / (q * q);
}

Eigen::Matrix2d PatchEnd::covariance_with(const PatchLine& line) const noexcept {
  const Eigen::Matrix2d d = by_line();
  return covariance + line.scale * line.scale * d * line.fit.covariance * d.transpose();
}

Patches::Patches(const InverseRanges& ranges, const std::vector<Run>& runs, SeenBeyond seen)
    : ranges_(ranges), runs_(runs), seen_(seen), goes_on_(runs.size(), 0) {
  for (std::size_t k = 0; k + 1 < runs.size(); ++k)
    goes_on_[k] = may_go_on(ranges, runs[k], runs[k + 1]) ? 1 : 0;
}

std::size_t Patches::run_of(std::size_t element) const noexcept {
  const auto after = std::upper_bound(runs_.begin(), runs_.end(), element,
                                      [](std::size_t i, const Run& run) { return i < run.from; });
  return static_cast<std::size_t>(after - runs_.begin()) - 1;
}

// The first piece of the surface that a piece belongs to.
std::size_t Patches::surface_of(std::size_t run) const noexcept {
  while (run > 0 && goes_on_[run - 1]) --run;
  return run;
}

// Where a piece ends, up to the next corner: beyond a cut without a step it goes on.
std::size_t Patches::last_run_of(std::size_t run, bool is_later) const noexcept {
  const auto goes_on = [&](std::size_t k) { return goes_on_[k] && !runs_[k].meets_next; };
  while (is_later && goes_on(run)) ++run;
  while (!is_later && run > 0 && goes_on(run - 1)) --run;
  return run;
}

// As the wall on both sides of what stands before it: what tells two lines apart is a chi2 of two
// degrees of freedom.
bool Patches::are_on_one_line(std::size_t a, std::size_t b) const {
  constexpr double kMostChi2 = 25.0;
  const Eigen::Vector2d difference = runs_[a].fit.parameters - runs_[b].fit.parameters;
  const Eigen::Matrix2d covariance = runs_[a].scale * runs_[a].scale * runs_[a].fit.covariance +
                                     runs_[b].scale * runs_[b].scale * runs_[b].fit.covariance;
  return difference.dot(covariance.inverse() * difference) < kMostChi2;
}

Patch Patches::patch_of(std::size_t run, const std::vector<std::size_t>& all, bool is_alone) const {
  Patch patch;
  patch.run = run;
  patch.all = all;
  for (const std::size_t i : all) {
    const std::size_t of = run_of(i);
    const bool is_of_line = of == run || (is_alone && are_on_one_line(of, run));
    if (is_of_line && !is_mixed(runs_[of], i)) patch.elements.push_back(i);
    if (is_of_line || surface_of(of) == surface_of(run)) patch.surface.push_back(i);
  }
  patch.is_straight = static_cast<double>(patch.elements.size()) >=
                      kNearlyAll * static_cast<double>(patch.surface.size());
  return patch;
}

Patches::Content Patches::content_of(const MeasureRegion& region) const {
  Content content;
  content.counts.assign(runs_.size(), 0);
  for (std::size_t i = 0; i < ranges_.size() && !runs_.empty(); ++i) {
    if (!region.contains(point_of(ranges_, i))) continue;
    content.elements.push_back(i);
    ++content.counts[run_of(i)];
  }
  content.order.resize(runs_.size());
  std::iota(content.order.begin(), content.order.end(), std::size_t{0});
  std::stable_sort(content.order.begin(), content.order.end(), [&](std::size_t a, std::size_t b) {
    return content.counts[a] > content.counts[b];
  });
  return content;
}

// Of one surface's bends none is a rival: what they are is for the tool to say.
bool Patches::has_rival(const Content& content, std::size_t wanted) const {
  const auto least = static_cast<double>(content.counts[content.order[wanted - 1]]);
  return std::any_of(content.order.begin() + static_cast<std::ptrdiff_t>(wanted),
                     content.order.end(), [&](std::size_t k) {
                       if (static_cast<double>(content.counts[k]) <= kRival * least) return false;
                       if (wanted > 1) return true;
                       return surface_of(k) != surface_of(content.order[0]) &&
                              !are_on_one_line(k, content.order[0]);
                     });
}

// In whatever pieces.
MeasureStatus Patches::find_all_in(const MeasureRegion& region, std::vector<Patch>& patches) const {
  const Content content = content_of(region);
  if (content.elements.size() < kFewestOfPiece) return MeasureStatus::kFewPoints;
  patches.push_back(patch_of(content.order[0], content.elements, false));
  return MeasureStatus::kOk;
}

MeasureStatus Patches::find_in(const MeasureRegion& region, std::size_t wanted,
                               std::vector<Patch>& patches) const {
  Content content = content_of(region);
  std::vector<std::size_t>& order = content.order;
  if (order.size() < wanted || content.counts[order[wanted - 1]] < kFewestOfPiece)
    return MeasureStatus::kFewPoints;
  if (has_rival(content, wanted)) return MeasureStatus::kAmbiguous;
  order.resize(wanted);
  std::sort(order.begin(), order.end());
  for (const std::size_t k : order) {
    patches.push_back(patch_of(k, content.elements, wanted == 1));
    if (wanted > 1) patches.back().is_straight = true;  // Each is meant for itself.
  }
  return MeasureStatus::kOk;
}

MeasureStatus Patches::find(const MeasureTool& tool, std::vector<Patch>& patches) const {
  patches.clear();
  std::vector<MeasureRegion> regions = tool.regions;
  if (regions.empty()) regions.emplace_back();
  const bool is_area = tool.kind == ToolKind::kArea;
  if (tool.kind == ToolKind::kCircle || (is_area && regions.size() == 1))
    return find_all_in(regions[0], patches);
  if (regions.size() == 1) return find_in(regions[0], patches_of(tool.kind), patches);
  const MeasureStatus first = find_in(regions[0], 1, patches);
  if (first != MeasureStatus::kOk) return first;
  return is_area ? find_all_in(regions[1], patches) : find_in(regions[1], 1, patches);
}

PatchEnd Patches::end_of(const InverseRanges& ranges, const Patch& patch, const PatchLine& line,
                         bool is_later) const {
  const std::size_t at = last_run_of(patch.run, is_later);
  const Run& run = runs_[at];
  PatchEnd end;
  const bool is_corner = is_later ? run.meets_next : at > 0 && runs_[at - 1].meets_next;
  if (is_corner) {
    const std::size_t k = is_later ? at : at - 1;
    Run left = runs_[k];
    Run right = runs_[k + 1];
    left.fit = fit_run(ranges, left);
    right.fit = fit_run(ranges, right);
    const Meeting meeting = meet(ranges, left, right);
    end.at_m = ranges.pivot + meeting.point_m;
    end.covariance = meeting.covariance;
    return end;
  }
  const SurfaceEdge edge = edge_beyond(ranges, line.fit, run.from, run.to, is_later);
  end.at_m = edge.at_m;
  end.direction = edge.direction;
  end.q = edge.q;
  const Eigen::Vector2d along = line.line.direction();
  end.covariance = edge.sigma_m * edge.sigma_m * along * along.transpose();
  return end;
}

bool Patches::is_end_seen(const Patch& patch, const MeasureRegion& region, bool is_later) const {
  const Run& run = runs_[last_run_of(patch.run, is_later)];
  const std::size_t outer = is_later ? run.to - 1 : run.from;
  if (!region.contains(point_of(ranges_, outer))) return false;
  // Where the field of view ends the surface may go on.
  return is_later ? seen_.last || run.to < ranges_.size() : seen_.first || run.from > 0;
}

}  // namespace striper::detail
