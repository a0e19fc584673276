// SPDX-License-Identifier: Apache-2.0
#include "profile/joints.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "profile/partition.hpp"

namespace striper::detail {
namespace {

// By how much a broken line may fit worse than two lines, which have one parameter more and their
// choice of dozens of places: 4 sigmas.
constexpr double kMostGrowth = 16.0;
// How far from the cut the knot is looked for, returns: four sigmas of a corner that is just found
// in 640.
constexpr std::size_t kReach = 240;
// A knot is tried at every return. Of sharp corners with little noise it is none of them but lies
// between two, which are not far from the cut: a return at the corner itself may be on either side.
constexpr std::size_t kNearCuts = 2;
// The cut settles in one or two rounds, or moves to and fro between neighbours.
constexpr int kRounds = 5;

// The angle from `from` to `to`, small ones.
double turn(const Eigen::Vector2d& from, const Eigen::Vector2d& to) noexcept {
  return from.x() * to.y() - from.y() * to.x();
}

Eigen::Vector2d direction_of(const InverseRanges& ranges, std::size_t i) noexcept {
  return {ranges.cosine[i], ranges.sine[i]};
}

// The first element of the right run if the cut is at a direction; 0 where that leaves one of them
// too little.
std::size_t cut_at(const InverseRanges& ranges, const Run& left, const Run& right,
                   const Eigen::Vector2d& direction) noexcept {
  const double sense = ranges.turn(left.to - 1, right.from) > 0.0 ? 1.0 : -1.0;
  const auto is_left = [&](std::size_t i) {
    return sense * turn(direction_of(ranges, i), direction) > 0.0;
  };
  std::size_t cut = left.to;
  while (cut > left.from && !is_left(cut - 1)) --cut;
  while (cut < right.to && is_left(cut)) ++cut;
  const bool is_enough = cut >= left.from + kFewestOfPiece && cut + kFewestOfPiece <= right.to;
  return is_enough ? cut : 0;
}

// By how far the lens and the column's own width carry light across, columns, one sigma: half a
// pixel and 1 / sqrt(12).
constexpr double kBlur = 0.58;
// A bias of less than this, sigmas of the return, is left in: of a line of a dozen returns the end
// moves by a twelfth of its sigma.
constexpr double kLeastBias = 0.25;

std::size_t clear_of(const Run& run) noexcept {
  return run.to - run.from - std::min(run.to - run.from, run.mixed_at_begin + run.mixed_at_end);
}

// How far a column beside a corner, seen through that blur, lies off its surface, columns times the
// kink: the mean of a hinge under a Gaussian.
double mixing(double columns) noexcept {
  const double t = columns / kBlur;
  const double density = std::exp(-0.5 * t * t) / std::sqrt(2.0 * std::numbers::pi);
  return kBlur * (density - 0.5 * t * std::erfc(t / std::numbers::sqrt2));
}

// Whether element i sees both sides of a corner by more than its noise.
bool is_mixed(const InverseRanges& ranges, const Meeting& corner, double spacing, double kink,
              std::size_t i) noexcept {
  const double columns = std::abs(turn(corner.direction, direction_of(ranges, i))) / spacing;
  return kink * spacing * mixing(columns) * std::sqrt(ranges.weight[i]) > kLeastBias;
}

// A fit about the direction of an element as one of the pivot's axes.
LineFit turned_back(const InverseRanges& ranges, std::size_t about, LineFit fit) noexcept {
  Eigen::Matrix2d turned;
  turned << ranges.cosine[about], -ranges.sine[about], ranges.sine[about], ranges.cosine[about];
  fit.parameters = turned * fit.parameters;
  fit.covariance = turned * fit.covariance * turned.transpose();
  return fit;
}

}  // namespace

LineFit fit_run(const InverseRanges& ranges, std::size_t from, std::size_t to) noexcept {
  const std::size_t about = from + (to - from) / 2;
  LineSums sums;
  for (std::size_t i = from; i < to; ++i) ranges.add_rotated(sums, i, about);
  return turned_back(ranges, about, sums.solve());
}

LineFit fit_run(const InverseRanges& ranges, const Run& run) noexcept {
  return fit_run(ranges, run.from + run.mixed_at_begin, run.to - run.mixed_at_end);
}

LineFit fit_elements(const InverseRanges& ranges, std::span<const std::size_t> elements) noexcept {
  if (elements.empty()) return {};
  const std::size_t about = elements[elements.size() / 2];
  LineSums sums;
  for (const std::size_t i : elements) ranges.add_rotated(sums, i, about);
  return turned_back(ranges, about, sums.solve());
}

// On both lines (l - r) . v = 0; the distance there is 1 / (l . v).
Meeting meet(const InverseRanges& ranges, const Run& left, const Run& right) noexcept {
  Meeting meeting;
  const Eigen::Vector2d& l = left.fit.parameters;
  const Eigen::Vector2d& r = right.fit.parameters;
  const Eigen::Vector2d bend = l - r;
  if (!(bend.squaredNorm() > 0.0)) return meeting;
  Eigen::Vector2d v = Eigen::Vector2d(-bend.y(), bend.x()).normalized();
  if (v.dot(direction_of(ranges, left.to - 1)) < 0.0) v = -v;
  const double q = l.dot(v);
  if (!(q > 0.0)) return meeting;
  const Eigen::Vector2d across(-v.y(), v.x());
  const double kink = across.dot(bend);
  Eigen::Matrix<double, 1, 4> d_angle;
  d_angle << -v.transpose() / kink, v.transpose() / kink;
  Eigen::Matrix<double, 1, 4> d_q = across.dot(l) * d_angle;
  d_q.head<2>() += v.transpose();
  const Eigen::Matrix<double, 2, 4> d_point = across * d_angle / q - v * d_q / (q * q);
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  covariance.topLeftCorner<2, 2>() = left.scale * left.scale * left.fit.covariance;
  covariance.bottomRightCorner<2, 2>() = right.scale * right.scale * right.fit.covariance;
  meeting.direction = v;
  meeting.sigma_rad = std::sqrt((d_angle * covariance * d_angle.transpose()).value());
  meeting.point_m = v / q;
  meeting.covariance = d_point * covariance * d_point.transpose();
  meeting.exists = true;
  return meeting;
}

bool is_blurred_corner(const InverseRanges& ranges, const Run& left, const Run& between,
                       const Run& right) noexcept {
  constexpr std::size_t kMost = 4;     // Columns: two sigmas of blur on either side.
  constexpr std::size_t kFewest = 10;  // Of a surface that tells where its corner is.
  constexpr double kNoise = 3.0;       // Sigmas.
  const std::size_t count = between.to - between.from;
  for (const Run* run : {&left, &between, &right})
    if (run->is_rough || run->is_circular) return false;
  if (count > kMost) return false;
  if (left.to - left.from < kFewest || right.to - right.from < kFewest) return false;
  const Meeting corner = meet(ranges, left, right);
  if (!corner.exists) return false;
  const double spacing = ranges.turn(left.to - 1, right.from) / static_cast<double>(count + 1);
  const Eigen::Vector2d bend = left.fit.parameters - right.fit.parameters;
  const double kink = std::abs(turn(corner.direction, bend));
  for (std::size_t i = between.from; i < between.to; ++i) {
    const Eigen::Vector2d direction = direction_of(ranges, i);
    const double columns = turn(direction, corner.direction) / spacing;
    if (!(std::abs(columns) <= static_cast<double>(kMost))) return false;
    const bool is_left = columns > 0.0;
    const double own = (is_left ? left : right).fit.parameters.dot(direction);
    const double other = (is_left ? right : left).fit.parameters.dot(direction);
    // Blur takes the lower of two lines lower, the higher one higher.
    const double off = other > own ? own - ranges.q[i] : ranges.q[i] - own;
    const double noise = kNoise / std::sqrt(ranges.weight[i]);
    const double blur = kink * std::abs(spacing) * mixing(std::abs(columns));
    if (off < -noise || off > 2.0 * blur + noise) return false;
  }
  return true;
}

void CornerSearch::take_sums(const InverseRanges& ranges, const Run& left, const Run& right) {
  first_ = left.from;
  about_ = right.from;
  before_.resize(std::max(before_.size(), right.to - first_ + 1));
  before_[0] = {};
  for (std::size_t i = first_; i < right.to; ++i) {
    before_[i + 1 - first_] = before_[i - first_];
    ranges.add_rotated(before_[i + 1 - first_], i, about_);
  }
}

LineSums CornerSearch::sums(std::size_t from, std::size_t to) const noexcept {
  LineSums sums = before_[to - first_];
  sums -= before_[from - first_];
  return sums;
}

void CornerSearch::cut_run_pair(const InverseRanges& ranges, std::size_t cut, Run& left,
                                Run& right) const {
  left.to = right.from = cut;
  for (Run* run : {&left, &right}) {
    if (clear_of(*run) < kFewestOfPiece) run->mixed_at_begin = run->mixed_at_end = 0;
    const LineSums clear = sums(run->from + run->mixed_at_begin, run->to - run->mixed_at_end);
    run->fit = turned_back(ranges, about_, clear.solve());
  }
}

// Of two lines that meet between the last element of the left and the first of the right run;
// infinite where they meet elsewhere.
double CornerSearch::chi2_if_met_at(const InverseRanges& ranges, std::size_t cut, const Run& left,
                                    const Run& right) const noexcept {
  const LineFit l = turned_back(ranges, about_, sums(left.from, cut).solve());
  const LineFit r = turned_back(ranges, about_, sums(cut, right.to).solve());
  const Eigen::Vector2d bend = l.parameters - r.parameters;
  Eigen::Vector2d v(-bend.y(), bend.x());  // Where they meet, or behind the pivot.
  if (v.dot(direction_of(ranges, cut)) < 0.0) v = -v;
  const double sense = ranges.turn(cut - 1, cut);
  const bool is_here = sense * turn(direction_of(ranges, cut - 1), v) > 0.0 &&
                       !(sense * turn(direction_of(ranges, cut), v) > 0.0) &&
                       l.parameters.dot(v) > 0.0;
  return is_here ? l.chi2 + r.chi2 : std::numeric_limits<double>::infinity();
}

// Of the line with a bend at each return: what the bend takes off chi2 of the straight one, and how
// well it is known (the third parameter's Schur complement; the others' is the same of all knots).
void CornerSearch::try_knots(const InverseRanges& ranges, const Run& left, const Run& right) {
  first_knot_ = std::max(left.from + kFewestOfPiece, about_ > kReach ? about_ - kReach : 0);
  const std::size_t last = std::min(right.to - kFewestOfPiece, about_ + kReach);
  const LineSums all = sums(left.from, right.to);
  const LineFit line = all.solve();
  least_chi2_ = std::numeric_limits<double>::infinity();
  likelihood_.clear();
  for (std::size_t knot = first_knot_; knot <= last; ++knot) {
    const double s = ranges.turn(about_, knot);
    const double c = std::sqrt(1.0 - s * s);
    const LineSums beyond = sums(knot, right.to);
    const Eigen::Vector2d with_line(c * beyond.fg - s * beyond.ff, c * beyond.gg - s * beyond.fg);
    const double alone = c * with_line[1] - s * with_line[0];
    const double information = alone - with_line.dot(line.covariance * with_line);
    const double bend = c * beyond.gz - s * beyond.fz - with_line.dot(line.parameters);
    const double chi2 = line.chi2 - bend * bend / information;
    likelihood_.push_back(-0.5 * (chi2 + std::log(information)));
    if (!(chi2 < least_chi2_)) continue;
    least_chi2_ = chi2;
    least_knot_ = knot;
  }
}

// Cuts near the knot, where the lines meet.
bool CornerSearch::settle_at(const InverseRanges& ranges, std::size_t knot, Run& left,
                             Run& right) const {
  Run l = left;
  Run r = right;
  for (int round = 0; round < kRounds; ++round) {
    cut_run_pair(ranges, knot, l, r);
    const Meeting meeting = meet(ranges, l, r);
    const std::size_t cut = meeting.exists ? cut_at(ranges, l, r, meeting.direction) : 0;
    if (cut == 0) return false;
    if (cut == knot) break;
    knot = cut;
  }
  left = l;
  right = r;
  return true;
}

bool CornerSearch::settle(const InverseRanges& ranges, Run& left, Run& right) {
  take_sums(ranges, left, right);
  double least = left.fit.chi2 + right.fit.chi2 + kMostGrowth;
  std::size_t knot = 0;  // None.
  const std::size_t first = std::max(left.from + kFewestOfPiece, about_ - kNearCuts);
  const std::size_t last = std::min(right.to - kFewestOfPiece, about_ + kNearCuts);
  for (std::size_t cut = first; cut <= last; ++cut) {
    const double chi2 = chi2_if_met_at(ranges, cut, left, right);
    if (!(chi2 < least)) continue;
    least = chi2;
    knot = cut;
  }
  try_knots(ranges, left, right);
  if (least_chi2_ < least) knot = least_knot_;
  if (knot == 0 || !settle_at(ranges, knot, left, right)) return false;
  left.knot = knot_of(ranges);
  leave_out_mixed(ranges, left, right);
  return true;
}

// A wrong column at the end of a line moves the corner by more than the loss of a right one.
void CornerSearch::leave_out_mixed(const InverseRanges& ranges, Run& left, Run& right) const {
  const Meeting corner = meet(ranges, left, right);
  const double spacing = std::abs(ranges.turn(left.to - 1, right.from));
  const double kink = std::abs(turn(corner.direction, left.fit.parameters - right.fit.parameters));
  const bool is_left = is_mixed(ranges, corner, spacing, kink, left.to - 1);
  const bool is_right = is_mixed(ranges, corner, spacing, kink, right.from);
  if (is_left && clear_of(left) > kFewestOfPiece) left.mixed_at_end = 1;
  if (is_right && clear_of(right) > kFewestOfPiece) right.mixed_at_begin = 1;
  cut_run_pair(ranges, left.to, left, right);
}

Knot CornerSearch::knot_of(const InverseRanges& ranges) const {
  constexpr double kNegligible = 30.0;
  const double most = *std::max_element(likelihood_.begin(), likelihood_.end());
  double sum = 0.0;
  double mean = 0.0;
  double square = 0.0;
  for (std::size_t k = 0; k < likelihood_.size(); ++k) {
    if (likelihood_[k] < most - kNegligible) continue;
    const double weight = std::exp(likelihood_[k] - most);
    const double sine = ranges.turn(about_, first_knot_ + k);
    sum += weight;
    mean += weight * sine;
    square += weight * sine * sine;
  }
  mean /= sum;
  const Eigen::Vector2d v = direction_of(ranges, about_);
  Knot knot;
  knot.direction = std::sqrt(1.0 - mean * mean) * v + mean * Eigen::Vector2d(-v.y(), v.x());
  knot.sigma_rad = std::sqrt(std::max(square / sum - mean * mean, 0.0));
  return knot;
}

Meeting meet_at_knot(const InverseRanges& ranges, const Run& left, const Run& right) noexcept {
  constexpr double kColumns = 2.0;  // Below, knots at returns are too coarse a choice.
  const Knot& knot = left.knot;
  Meeting meeting = meet(ranges, left, right);
  if (knot.sigma_rad < kColumns * std::abs(ranges.turn(left.to - 1, right.from))) return meeting;
  const Eigen::Vector2d& v = knot.direction;
  const Eigen::Vector2d across(-v.y(), v.x());
  // Both lines say where it is along this direction.
  const double of_left = 1.0 / left.fit.variance_at(v.x(), v.y());
  const double of_right = 1.0 / right.fit.variance_at(v.x(), v.y());
  const double q = (of_left * left.fit.at(v.x(), v.y()) + of_right * right.fit.at(v.x(), v.y())) /
                   (of_left + of_right);
  const double slope = 0.5 * across.dot(left.fit.parameters + right.fit.parameters);
  const Eigen::Vector2d by_angle = across / q - v * slope / (q * q);
  const double variance_q = 1.0 / (of_left + of_right);
  meeting.direction = v;
  meeting.sigma_rad = knot.sigma_rad;
  meeting.point_m = v / q;
  meeting.covariance = knot.sigma_rad * knot.sigma_rad * by_angle * by_angle.transpose() +
                       variance_q / (q * q * q * q) * v * v.transpose();
  return meeting;
}

}  // namespace striper::detail
