// SPDX-License-Identifier: Apache-2.0
#include "profile/joints.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

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

// The sums in coordinates turned by an angle.
LineSums turned(const LineSums& sums, double cosine, double sine) noexcept {
  LineSums out = sums;
  out.ff = sums.ff * cosine * cosine + 2.0 * sums.fg * cosine * sine + sums.gg * sine * sine;
  out.gg = sums.gg * cosine * cosine - 2.0 * sums.fg * cosine * sine + sums.ff * sine * sine;
  out.fg = sums.fg * (cosine * cosine - sine * sine) + (sums.gg - sums.ff) * cosine * sine;
  out.fz = sums.fz * cosine + sums.gz * sine;
  out.gz = sums.gz * cosine - sums.fz * sine;
  return out;
}

// The best line with a bend where g is 0.
struct Bent {
  double chi2;
  double information;  // Determinant of that on its three parameters.
};

Bent fit_bent(const LineSums& left, const LineSums& right) noexcept {
  Eigen::Matrix3d normal;
  normal << left.ff + right.ff, left.fg + right.fg, right.fg,  //
      left.fg + right.fg, left.gg + right.gg, right.gg,        //
      right.fg, right.gg, right.gg;
  const Eigen::Vector3d z(left.fz + right.fz, left.gz + right.gz, right.gz);
  return {left.zz + right.zz - z.dot(normal.inverse() * z), normal.determinant()};
}

// Cuts near the knot, where the lines meet.
bool settle_at(const InverseRanges& ranges, std::size_t knot, Run& left, Run& right) noexcept {
  Run l = left;
  Run r = right;
  for (int round = 0; round < kRounds; ++round) {
    l.to = r.from = knot;
    l.fit = fit_run(ranges, l.from, knot);
    r.fit = fit_run(ranges, knot, r.to);
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

// Of two lines that meet between the last element of the left and the first of the right run;
// infinite where they meet elsewhere.
double chi2_if_met_at(const InverseRanges& ranges, std::size_t cut, const Run& left,
                      const Run& right) noexcept {
  Run l = left;
  Run r = right;
  l.to = r.from = cut;
  l.fit = fit_run(ranges, l.from, cut);
  r.fit = fit_run(ranges, cut, r.to);
  const Meeting meeting = meet(ranges, l, r);
  const bool is_here = meeting.exists && cut_at(ranges, l, r, meeting.direction) == cut;
  return is_here ? l.fit.chi2 + r.fit.chi2 : std::numeric_limits<double>::infinity();
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

bool CornerSearch::settle(const InverseRanges& ranges, Run& left, Run& right) {
  const std::size_t about = right.from;
  before_.resize(std::max(before_.size(), right.to - left.from + 1));
  before_[0] = {};
  for (std::size_t i = left.from; i < right.to; ++i) {
    before_[i + 1 - left.from] = before_[i - left.from];
    ranges.add_rotated(before_[i + 1 - left.from], i, about);
  }
  const std::size_t from =
      std::max(left.from + kFewestOfPiece, about > kReach ? about - kReach : 0);
  const std::size_t to = std::min(right.to - kFewestOfPiece, about + kReach);
  std::size_t knot = about;
  double least = left.fit.chi2 + right.fit.chi2 + kMostGrowth;
  bool is_bent = false;
  for (std::size_t cut = std::max(from, about - kNearCuts); cut <= std::min(to, about + kNearCuts);
       ++cut) {
    const double chi2 = chi2_if_met_at(ranges, cut, left, right);
    if (!(chi2 < least)) continue;
    least = chi2;
    knot = cut;
    is_bent = true;
  }
  likelihood_.clear();
  for (std::size_t cut = from; cut <= to; ++cut) {
    const double sine = ranges.turn(about, cut);
    const double cosine = std::sqrt(1.0 - sine * sine);
    LineSums beyond = before_[right.to - left.from];
    beyond -= before_[cut - left.from];
    const Bent bent =
        fit_bent(turned(before_[cut - left.from], cosine, sine), turned(beyond, cosine, sine));
    likelihood_.push_back(-0.5 * (bent.chi2 + std::log(bent.information)));
    if (!(bent.chi2 < least)) continue;
    least = bent.chi2;
    knot = cut;
    is_bent = true;
  }
  if (!is_bent || !settle_at(ranges, knot, left, right)) return false;
  left.knot = knot_of(ranges, about, from);
  return true;
}

// @param from  the element of the first likelihood.
Knot CornerSearch::knot_of(const InverseRanges& ranges, std::size_t about, std::size_t from) const {
  const double most = *std::max_element(likelihood_.begin(), likelihood_.end());
  double sum = 0.0;
  double mean = 0.0;
  double square = 0.0;
  for (std::size_t k = 0; k < likelihood_.size(); ++k) {
    const double weight = std::exp(likelihood_[k] - most);
    const double sine = ranges.turn(about, from + k);
    sum += weight;
    mean += weight * sine;
    square += weight * sine * sine;
  }
  mean /= sum;
  const Eigen::Vector2d v = direction_of(ranges, about);
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
