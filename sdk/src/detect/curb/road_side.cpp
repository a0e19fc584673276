// SPDX-License-Identifier: Apache-2.0
#include "detect/curb/road_side.hpp"

#include <algorithm>
#include <cmath>

#include <striper/core/units.hpp>

namespace striper::detail {
namespace {

// Gutters fall by 6 degrees, roads lean by 3, ramps for wheels by 6; what rises by more is looked
// at.
constexpr double kLevel_rad = 15.0 * kDegree;

// Ground is uneven by less: patches, slabs, gutters' lips.
constexpr double kUneven_m = 0.02;

constexpr int kFewestPoints = 3;        // Fewer are on anything.
constexpr double kLeastGround_m = 0.1;  // Of a piece that is ground of its own.
constexpr double kLeastBehind_m = 0.15;
constexpr int kSurePoints = 10;
constexpr double kSureBend = 3.0;  // Times what a piece had to gain; by chance it is 1.5 at most.
constexpr double kStrays = 2.0;    // One lies on a line with any other return.

// The surface beyond an edge is looked at so far: stones are 12 to 15 cm wide, and grass begins
// behind many.
constexpr double kLookedAt_m = 0.12;
constexpr double kLookedAtMost_m = 0.3;
constexpr std::size_t kToldBy = 8;  // Returns.
constexpr double kNose_m = 0.02;
// Log odds at most where returns go on beyond but hardly any is on that surface: it may be dark, or
// behind what is parked.
constexpr double kShadowed = 2.0;

// Of grass at the road's own level: a piece of it scatters beyond paving (GroundRoughness) with
// more certainty than a track lets one scan have.
constexpr double kVergeLogOdds = 30.0;

// What is so much higher than the lowest seen of it stands on it, with its foot this much nearer.
// Chosen among .03 to .06 and .05 to .08 m by what stands behind the curbs of the real rings
// (curb_real_test.cpp), which therefore do not judge it.
constexpr double kStanding_m = 0.04;
constexpr double kBeforeStanding_m = 0.08;

// Of a face that no return is on: upright, to the 20 degrees that faces lean by.
constexpr double kFaceLean_rad = 20.0 * kDegree;
// Of a top that is not seen: level, to the slope of a road.
constexpr double kTopLean_rad = 3.0 * kDegree;

// Of a piece's columns, how many gave no return. Where some do, the last ones of a face may be
// missing, and a top of too few to be a piece may have been taken for its end.
double missing_part(const Piece& piece) {
  const auto columns = static_cast<double>(piece.last - piece.first + 1);
  return std::max(0.0, 1.0 - piece.points / columns);
}

}  // namespace

bool RoadSide::Strip::is_at(double z_m) const { return std::abs(near.y() - z_m) < kUneven_m; }

const Piece& RoadSide::piece(Index k) const {
  return scan_->pieces.pieces[static_cast<std::size_t>(k)];
}

const Run& RoadSide::run(Index k) const { return scan_->cutter.runs[static_cast<std::size_t>(k)]; }

bool RoadSide::has(Index k) const {
  return k >= 0 && k < static_cast<Index>(scan_->pieces.pieces.size());
}

RoadSide::Strip RoadSide::strip(Index k) const {
  const ScanLine& ground = piece(ground_).line;
  const Piece& p = piece(k);
  const auto seen = [&](const Eigen::Vector2d& at) {
    return Eigen::Vector2d(out_.dot(at), -ground.offset_m(at));
  };
  Strip s;
  s.near = seen(step_ > 0 ? p.begin_m : p.end_m);
  s.far = seen(step_ > 0 ? p.end_m : p.begin_m);
  s.slope_rad = std::atan2(s.far.y() - s.near.y(), s.far.x() - s.near.x());
  s.is_level = std::abs(s.slope_rad) < kLevel_rad;
  s.is_rough = p.is_rough && !is_paved(scatter_m(scan_->cutter.ranges, run(k)));
  s.points = p.points;
  return s;
}

void RoadSide::take_ground(Index k) {
  reach_m_ = std::max(reach_m_, strip(k).far.x());
  ground_ = k;
  out_ = piece(k).line.direction();
  if (out_.dot(along_) < 0.0) out_ = -out_;
}

void RoadSide::begin_at(Index ground) {
  ground_ = ground;
  leaving_ = face_ = top_ = behind_ = kNowhere;
  evidence_ = CurbEvidence{};
  evidence_.penalty = scan_->pieces.penalty;
}

RoadEnd RoadSide::look(const CutScan& scan, std::size_t road, const Eigen::Vector2d& along,
                       double out) {
  scan_ = &scan;
  along_ = out_ = out * along;
  first_ = static_cast<Index>(road);
  begin_at(first_);
  const Piece& first = piece(ground_);
  step_ = (first.end_m - first.begin_m).dot(out_) > 0.0 ? 1 : -1;
  reach_m_ = strip(ground_).far.x();
  RoadEnd end;
  std::size_t count = 0;
  while (count < kMostFindings) {
    const auto found = next();
    if (count == 0) end.lateral_m = out * reach_m_;
    if (!found) break;
    findings_[count] = *found;
    if (out < 0.0) findings_[count].lateral_m = -found->lateral_m;
    ++count;
    if (!has(behind_) || found->kind != CurbKind::kObject) break;
    take_ground(behind_);
    begin_at(behind_);
  }
  end.findings = {findings_.data(), count};
  return end;
}

std::optional<CurbFinding> RoadSide::next() {
  find_leaving();
  if (!has(leaving_)) return std::nullopt;
  const bool is_flat = leaves_.slope_rad < kLeastFace_rad;
  if (leaves_.is_rough && leaves_.is_at(0.0) && is_flat) return verge();
  const bool is_drop = leaves_.near.y() < -kUneven_m && leaves_.slope_rad < kLevel_rad;
  return is_drop ? drop() : rise();
}

// Water runs along it: lower than the road, by less than anything counts.
bool RoadSide::is_gutter(const Strip& s) const {
  return s.near.y() < 0.0 && s.near.y() > -scan_->options.min_height_m;
}

// Where returns at a surface's end are cut off by chance they are no surface of their own: their
// line tells little of where the face stands, or where it ends. A few must have gained more, and
// not by one stray, which lies on a line with any other return.
bool RoadSide::is_bend(Index k) const {
  const Piece& p = piece(k);
  if (p.points >= kSurePoints) return !(p.evidence < evidence_.penalty);
  double gain = 0.0;
  for (std::size_t i = run(k).from; i < run(k).to; ++i) {
    double least = kStrayChi2;
    for (const Index beside : {k - 1, k + 1})
      if (has(beside)) least = std::min(least, misfit(scan_->cutter.ranges, i, piece(beside).line));
    gain += least;
  }
  return gain >= kStrays * kStrayChi2 && !(p.evidence < kSureBend * evidence_.penalty);
}

// Whether a piece is some returns of a face and of the top behind it, cut off by chance.
bool RoadSide::is_chip_of(Index k, Index behind) const {
  if (!has(behind) || is_bend(k)) return false;
  const Strip top = strip(behind);
  const bool is_surface = top.is_level && !top.is_rough && top.points >= kSurePoints;
  const double apart_m = std::abs(top.near.y() - strip(k).far.y());
  return is_surface && top.near.y() > kUneven_m && apart_m < kUneven_m;
}

// The ground bends and changes on the way: gutters, crowns, slabs.
void RoadSide::find_leaving() {
  for (Index k = ground_ + step_; has(k); k += step_) {
    const Strip s = strip(k);
    if (s.points < kFewestPoints) continue;
    const bool is_small = std::abs(s.near.y()) < kUneven_m && std::abs(s.far.y()) < kUneven_m;
    const bool is_ground = s.is_level && (s.is_at(0.0) || is_gutter(s));
    if (s.is_rough && (is_ground || is_small) && s.length_m() < kLeastBehind_m) continue;
    if (!s.is_rough && is_ground) {
      reach_m_ = std::max(reach_m_, s.far.x());
      if (s.length_m() >= kLeastGround_m && is_bend(k)) take_ground(k);
      continue;
    }
    if (!s.is_rough && is_small) continue;
    if (s.slope_rad < -kLevel_rad && s.near.y() > -kUneven_m) continue;  // A hump's far side.
    leaving_ = k;
    leaves_ = s;
    return;
  }
}

// The face is the highest of what is steep, or, where nothing is, of what rises at all; the top is
// what is flat behind it, be it a bank.
void RoadSide::find_top() {
  double highest_m = 0.0;
  bool is_face_steep = false;
  for (Index k = leaving_; has(k); k += step_) {
    const Strip s = strip(k);
    if (s.points < kFewestPoints) continue;
    const bool is_steep = s.slope_rad >= kLeastFace_rad;
    const double height_m = s.far.y() - s.near.y();
    const bool is_better = is_steep != is_face_steep ? is_steep : height_m > highest_m;
    if (has(face_) && !is_better && is_chip_of(k, k + step_)) continue;
    const bool is_surface = (s.far - s.near).norm() >= kLeastGround_m;
    if (s.slope_rad < kLevel_rad || (is_face_steep && !is_steep && is_surface)) {
      if (s.slope_rad > -kLevel_rad && s.near.y() > kUneven_m) top_ = k;
      return;
    }
    if (is_steep && !is_face_steep && has(face_) && highest_m >= kLeastGround_m) return;
    if (!is_better) continue;
    highest_m = height_m;
    is_face_steep = is_steep;
    face_ = k;
  }
}

void RoadSide::look_behind(Index from) {
  for (Index k = from; has(k); k += step_) {
    const Strip s = strip(k);
    if (!s.is_level || s.points < kFewestPoints) continue;
    const double middle = 0.5 * (s.near.y() + s.far.y());
    if (middle > kUneven_m && has(top_)) evidence_.top_length_m = s.far.x() - strip(top_).near.x();
    if (std::abs(middle) >= 2.0 * kUneven_m || s.length_m() <= kLeastBehind_m) continue;
    evidence_.is_ground_behind = true;
    if (!has(behind_)) behind_ = k;
  }
}

double RoadSide::gain(Index k) const {
  if (!has(k)) return 0.0;
  double chi2 = 0.0;
  for (std::size_t i = run(k).from; i < run(k).to; ++i)
    chi2 += misfit(scan_->cutter.ranges, i, piece(ground_).line);
  return chi2 - run(k).fit.chi2;
}

// Of the surface that begins at an edge: its first decimetre, behind the nose and before what
// stands on it; more where so little of it is seen that it does not tell.
double RoadSide::overgrown_beyond(const Eigen::Vector2d& edge_m) {
  const InverseRanges& ranges = scan_->cutter.ranges;
  const ScanLine& ground = piece(ground_).line;
  const Eigen::Vector2d edge(out_.dot(edge_m), -ground.offset_m(edge_m));
  const double road_m = scatter_m(ranges, run(ground_));  // Of the sensor then, if not of both.
  double end = edge.x() + kLookedAtMost_m;
  double lowest = edge.y() + kUneven_m;
  bool is_passed = false;
  roughness_.clear();
  for (Index i = first_beyond(edge_m); i >= 0 && i < static_cast<Index>(ranges.size());
       i += step_) {
    const auto k = static_cast<std::size_t>(i);
    const Eigen::Vector2d at(out_.dot(ranges.at_m(k)), -ground.offset_m(ranges.at_m(k)));
    if (at.x() > end + kBeforeStanding_m) {
      is_passed = true;
      break;
    }
    if (at.y() > lowest + kStanding_m) {
      end = std::min(end, at.x() - kBeforeStanding_m);
      break;
    }
    if (at.x() < edge.x() + kNose_m) continue;
    lowest = std::min(lowest, at.y());
    if (roughness_.size() + 1 == kToldBy)
      end = std::min(end, std::max(at.x(), edge.x() + kLookedAt_m));
    const double per_metre = ranges.q[k] / ground.distance_m;
    roughness_.add(at, ranges.noise[k] / (per_metre * per_metre) + road_m * road_m);
  }
  roughness_.end_at(end);
  if (is_passed && !roughness_.can_tell()) {
    const Eigen::Vector2d from_m = edge_m + kNose_m * out_;
    return std::min(kShadowed, GroundRoughness::log_odds_of_too_few(
                                   returns_between(from_m, edge_m + kLookedAtMost_m * out_)));
  }
  return roughness_.log_odds_of_overgrown();
}

// How many returns a surface from here to there would have, were they as many an angle as the
// ground has.
double RoadSide::returns_between(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m) const {
  const InverseRanges& ranges = scan_->cutter.ranges;
  const Run& ground = run(ground_);
  const auto turn = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return std::abs(std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)));
  };
  const double seen = std::asin(std::abs(ranges.turn(ground.from, ground.to - 1)));
  const double here = turn(from_m - ranges.pivot, to_m - ranges.pivot);
  return seen > 0.0 ? static_cast<double>(ground.to - 1 - ground.from) * here / seen : 0.0;
}

// The first element outwards of a place, seen from the pivot.
RoadSide::Index RoadSide::first_beyond(const Eigen::Vector2d& at_m) const {
  const InverseRanges& ranges = scan_->cutter.ranges;
  const Eigen::Vector2d to = at_m - ranges.pivot;
  const auto size = static_cast<Index>(ranges.size());
  const double sense = ranges.turn(0, ranges.size() - 1) > 0.0 ? step_ : -step_;
  Index i =
      static_cast<Index>(step_ > 0 ? run(ground_).to : run(ground_).from) - (step_ > 0 ? 0 : 1);
  while (i >= 0 && i < size) {
    const auto e = static_cast<std::size_t>(i);
    if (sense * (to.x() * ranges.sine[e] - to.y() * ranges.cosine[e]) > 0.0) break;
    i += step_;
  }
  return i;
}

// What is not seen is put where it has to be, with errors as large as what is known of it.
CurbLines RoadSide::first_lines() const {
  const Piece& ground = piece(ground_);
  const Eigen::Vector2d up = -ground.line.normal();
  CurbLines lines{ground.line, {}, {}};
  const bool is_up = step_ > 0;
  if (has(face_)) {
    lines.face = piece(face_).line;
  } else {
    const Eigen::Vector2d from = is_up ? ground.end_m : ground.begin_m;
    const Eigen::Vector2d to = is_up ? piece(top_).begin_m : piece(top_).end_m;
    const double gap = std::abs(out_.dot(to - from));
    const double sigma = std::hypot(gap, ground.sigma_end_m) / std::sqrt(12.0);
    lines.face = line_through(0.5 * (from + to), up, sigma, kFaceLean_rad);
  }
  if (has(top_)) {
    lines.top = piece(top_).line;
  } else {
    const Piece& face = piece(face_);
    const Eigen::Vector2d end = is_up ? face.end_m : face.begin_m;
    const bool is_end_seen = is_up ? face.is_end_seen : face.is_begin_seen;
    const double sigma = is_up ? face.sigma_end_m : face.sigma_begin_m;
    // Where the scan ends the face may go on.
    const double unseen = is_end_seen ? 0.0 : scan_->options.max_height_m / std::sqrt(12.0);
    const double whose = std::sqrt(12.0 * missing_part(face)) * kFewestPoints * sigma;
    lines.top = line_through(end, out_, std::hypot(sigma, unseen, whose), kTopLean_rad);
  }
  return lines;
}

// Where an element is in the ranges with speckle.
std::size_t RoadSide::with_speckle_at(std::size_t element) const {
  const auto& all = scan_->cutter.with_speckle().index;
  const auto at = std::lower_bound(all.begin(), all.end(), scan_->cutter.ranges.index[element]);
  return static_cast<std::size_t>(at - all.begin());
}

// The gate takes some of a face with few returns for speckle, or all.
std::optional<ScanLine> RoadSide::sparse_face() {
  if (!has(top_) || (has(face_) && piece(face_).points >= kSurePoints)) return std::nullopt;
  const std::size_t from = with_speckle_at(run(std::min(ground_, top_)).to - 1) + 1;
  const std::size_t to = with_speckle_at(run(std::max(ground_, top_)).from);
  const ScanLine* face = has(face_) ? &piece(face_).line : nullptr;
  return sparse_.find(scan_->cutter.with_speckle(), from, to,
                      {&piece(ground_).line, &piece(top_).line, face});
}

std::optional<CurbFinding> RoadSide::rise() {
  find_top();
  if (!has(face_) && !has(top_)) return std::nullopt;
  look_behind(has(top_) ? top_ : face_ + step_);
  CurbLines lines = first_lines();
  CurbLines sparse = lines;
  const auto face = sparse_face();
  if (face) sparse.face = *face;
  const bool is_sparse = face && sparse.do_meet();
  if (is_sparse) lines = sparse;
  if (!lines.do_meet()) return std::nullopt;
  if ((has(face_) || is_sparse) && has(top_)) {
    const std::size_t first = with_speckle_at(run(std::min(ground_, top_)).from);
    const std::size_t last = with_speckle_at(run(std::max(ground_, top_)).to - 1);
    refiner_.refine(scan_->cutter.with_speckle(), {first, last + 1, step_ > 0}, lines);
  }
  CurbFinding finding;
  lines.describe(out_, finding);
  const Piece& ground = piece(ground_);
  finding.road_m = step_ > 0 ? ground.begin_m : ground.end_m;
  const Piece& last = piece(has(top_) ? top_ : face_);
  finding.beyond_m = step_ > 0 ? last.end_m : last.begin_m;
  evidence_.gain = gain(face_) + gain(top_);
  finding.overgrown_log_odds = overgrown_beyond(finding.top_m);
  weigh(evidence_, scan_->options, finding);
  return finding;
}

std::optional<CurbFinding> RoadSide::drop() {
  const Piece& ground = piece(ground_);
  const Piece& lower = piece(leaving_);
  const bool is_up = step_ > 0;
  // Behind a hump the ground is below the hump's line, and where the road was.
  const Eigen::Vector2d& nearest = is_up ? lower.begin_m : lower.end_m;
  const bool is_below_road = piece(first_).line.offset_m(nearest) > kUneven_m;
  if (leaves_.length_m() < kLeastBehind_m || !leaves_.is_level || !is_below_road)
    return std::nullopt;
  CurbFinding f;
  f.road = ground.line;
  f.road_m = is_up ? ground.begin_m : ground.end_m;
  f.foot_m = is_up ? ground.end_m : ground.begin_m;
  f.top_m = is_up ? lower.begin_m : lower.end_m;
  f.beyond_m = is_up ? lower.end_m : lower.begin_m;
  f.lateral_m = out_.dot(f.foot_m);
  f.sigma_lateral_m = is_up ? ground.sigma_end_m : ground.sigma_begin_m;
  f.height_m = ground.line.offset_m(f.top_m);
  f.sigma_height_m =
      std::sqrt(ground.line.offset_variance_m2(f.top_m) + lower.line.offset_variance_m2(f.top_m));
  f.covariance.setZero();
  f.covariance.block<2, 2>(0, 0) = f.sigma_lateral_m * f.sigma_lateral_m * out_ * out_.transpose();
  f.covariance.block<2, 2>(2, 2) =
      f.sigma_height_m * f.sigma_height_m * ground.line.normal() * ground.line.normal().transpose();
  look_behind(leaving_ + step_);
  evidence_.gain = gain(leaving_);
  evidence_.is_down = true;
  f.overgrown_log_odds = overgrown_beyond(f.top_m);
  weigh(evidence_, scan_->options, f);
  return f;
}

// Grass at the road's own level has no height; where it begins is known to the road's end.
std::optional<CurbFinding> RoadSide::verge() const {
  const Piece& ground = piece(ground_);
  CurbFinding f;
  f.kind = CurbKind::kRough;
  f.posterior[static_cast<std::size_t>(CurbKind::kRough)] = 1.0;
  f.overgrown_log_odds = kVergeLogOdds;
  f.road = ground.line;
  f.foot_m = step_ > 0 ? ground.end_m : ground.begin_m;
  f.lateral_m = out_.dot(f.foot_m);
  f.sigma_lateral_m = step_ > 0 ? ground.sigma_end_m : ground.sigma_begin_m;
  return f;
}

}  // namespace striper::detail
