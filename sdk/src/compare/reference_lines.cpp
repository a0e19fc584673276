// SPDX-License-Identifier: Apache-2.0
#include "compare/reference_lines.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Core>
#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/robust.hpp>
#include <striper/geometry/line_fit.hpp>

namespace striper::detail {
namespace {

constexpr std::size_t kFewestBeams = 20;
constexpr double kNearGap_m = 0.03;
// Where returns are missing the surface is not known; one lost return is bridged.
constexpr double kLargestStep = 2.5;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// How far a point is from the line through two others.
double off_line(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  return std::abs(cross(along, p - a)) / along.norm();
}

}  // namespace

ReferenceLines::ReferenceLines(const PolarScan& reference, const CompareOptions& options)
    : options_(options) {
  for (const Return& one : reference.returns) {
    if (one.status != ReturnStatus::kOk || !std::isfinite(one.range_m)) continue;
    const double sigma_m = std::isfinite(one.sigma_m) ? one.sigma_m : options.reference_sigma_m;
    beams_.push_back(
        {one.bearing_rad, one.range_m, sigma_m,
         one.range_m * Eigen::Vector2d(std::cos(one.bearing_rad), std::sin(one.bearing_rad))});
  }
  if (beams_.size() < kFewestBeams)
    throw Error(ErrorKind::kUntrustworthy,
                fmt::format("the reference has {} returns, expected at least {}", beams_.size(),
                            kFewestBeams));
  std::sort(beams_.begin(), beams_.end(),
            [](const Beam& a, const Beam& b) { return a.bearing_rad < b.bearing_rad; });
  std::vector<double> steps;
  for (std::size_t i = 0; i + 1 < beams_.size(); ++i)
    steps.push_back(beams_[i + 1].bearing_rad - beams_[i].bearing_rad);
  usual_step_rad_ = upper_median(steps);
  lines_.resize(beams_.size() - 1);
  for (std::size_t first = 0, last = 0; last < beams_.size(); ++last) {
    if (last + 1 < beams_.size() && is_joined(last)) continue;
    split(first, last);
    first = last + 1;
  }
}

bool ReferenceLines::is_joined(std::size_t first) const {
  const Beam& a = beams_[first];
  const Beam& b = beams_[first + 1];
  if (b.bearing_rad - a.bearing_rad > kLargestStep * usual_step_rad_) return false;
  const double nearer_m = std::min(a.range_m, b.range_m);
  const double most_m = std::max(kNearGap_m, options_.largest_gap * nearer_m);
  return (a.point - b.point).norm() <= most_m;
}

// Straight pieces: where a run of joined beams is not, it is split at the beam farthest off the
// line through its ends (Ramer 1972, Douglas & Peucker 1973).
void ReferenceLines::split(std::size_t first, std::size_t last) {
  std::size_t farthest = first;
  double excess_m = 0.0;
  for (std::size_t i = first + 1; i < last; ++i) {
    // Rounding moves the ends, and the beam between them, by half a step each.
    const double tolerance_m =
        kStraight_m + 1.1 * options_.reference_quantum_m + 3.0 * beams_[i].sigma_m;
    const double off_m = off_line(beams_[i].point, beams_[first].point, beams_[last].point);
    if (off_m - tolerance_m <= excess_m) continue;
    excess_m = off_m - tolerance_m;
    farthest = i;
  }
  if (farthest == first) {
    add_lines(first, last);
    return;
  }
  split(first, farthest);
  split(farthest, last);
}

// Two beams alone are as likely an edge that a beam has met with both sides of. A line of many
// averages rounding, one of few follows what bends.
void ReferenceLines::add_lines(std::size_t first, std::size_t last) {
  constexpr std::array<std::size_t, 4> kNeighbours{12, 8, 5, 2};  // On either side.
  constexpr double kSigmas = 2.0;                                 // A bend of no more is none.
  while (last >= first + 3 && is_off(first, first + 1, last)) ++first;
  while (last >= first + 3 && is_off(last, first, last - 1)) --last;
  if (last < first + 2) return;
  for (std::size_t i = first; i < last; ++i) {
    for (const std::size_t neighbours : kNeighbours) {
      const std::size_t from = i > first + neighbours ? i - neighbours : first;
      const std::size_t to = std::min(last, i + 1 + neighbours);
      lines_[i] = line_through(from, to);
      const double bend = bend_m(from, to, lines_[i]);
      lines_[i].bend_m =
          std::sqrt(std::max(0.0, bend * bend - sigma_m(lines_[i]) * sigma_m(lines_[i])));
      if (bend <= kSigmas * sigma_m(lines_[i])) break;
    }
  }
}

// Whether a beam at the end of a piece is not of its surface: it has met the edge.
bool ReferenceLines::is_off(std::size_t end, std::size_t first, std::size_t last) const {
  constexpr std::size_t kNearest = 6;
  if (end < first) {
    last = std::min(last, first + kNearest);
  } else if (last > first + kNearest) {
    first = last - kNearest;
  }
  const ReferenceLine line = line_through(first, last);
  const double tolerance_m =
      kStraight_m + 0.75 * options_.reference_quantum_m + 3.0 * beams_[end].sigma_m;
  return std::abs(line.normal.dot(beams_[end].point - line.point)) > tolerance_m;
}

// How far the parabola through the beams is from the line, where it is farthest but for the ends.
double ReferenceLines::bend_m(std::size_t first, std::size_t last,
                              const ReferenceLine& line) const {
  const auto count = static_cast<double>(last - first + 1);
  const Eigen::Vector2d along(-line.normal.y(), line.normal.x());
  const auto square = [&](std::size_t i) {
    const double t = along.dot(beams_[i].point - line.point);
    return t * t;
  };
  double mean = 0.0;
  for (std::size_t i = first; i <= last; ++i) mean += square(i) / count;
  double product = 0.0;
  double squares = 0.0;
  for (std::size_t i = first; i <= last; ++i) {
    const double t2 = square(i) - mean;
    product += t2 * line.normal.dot(beams_[i].point - line.point);
    squares += t2 * t2;
  }
  return squares > 0.0 ? std::abs(product / squares) * mean : 0.0;
}

// Of a line across itself in its middle.
double ReferenceLines::sigma_m(const ReferenceLine& line) const {
  const double quantum_m = options_.reference_quantum_m;
  return std::sqrt(line.sigma_m * line.sigma_m + quantum_m * quantum_m / 12.0 / line.roundings);
}

ReferenceLine ReferenceLines::line_through(std::size_t first, std::size_t last) const {
  const auto count = static_cast<double>(last - first + 1);
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double variance = 0.0;
  for (std::size_t i = first; i <= last; ++i) {
    centre += beams_[i].point / count;
    variance += beams_[i].sigma_m * beams_[i].sigma_m / count;
  }
  // Across the chord, which is nearly the line: what counts across it counts across the line too.
  const Eigen::Vector2d chord = (beams_[last].point - beams_[first].point).normalized();
  const Eigen::Vector2d across(-chord.y(), chord.x());
  LineSums sums;
  for (std::size_t i = first; i <= last; ++i) {
    const Eigen::Vector2d p = beams_[i].point - centre;
    sums.add(1.0, chord.dot(p), across.dot(p), 1.0);
  }
  const LineFit fit = sums.solve();
  ReferenceLine line;
  line.status = ReferenceLine::Status::kFound;
  line.point = centre;
  line.normal = (across - fit.parameters[1] * chord).normalized();
  if (line.normal.dot(centre) > 0.0) line.normal = -line.normal;
  line.sigma_m = std::sqrt(variance / count);
  line.roundings = independent_roundings(first, last);
  const double quantum_m = options_.reference_quantum_m;
  const double rounding2 = quantum_m * quantum_m / 12.0 * count / line.roundings;
  const double spread2_m2 = 1.0 / fit.covariance(1, 1);
  line.sigma_normal_rad = std::sqrt((variance + rounding2) / spread2_m2);
  // Along a straight surface rounding is a sawtooth: of R teeth over a length L it turns the line
  // by about 0.6 / R of a step over L, one sigma.
  const double turn = 0.6 * quantum_m / line.roundings;
  line.sigma_turn_rad = std::sqrt((variance + turn * turn * count / 12.0) / spread2_m2);
  return line;
}

// Ranges that do not change by a step are all rounded by the same amount; those that change by
// several are rounded independently of one another.
double ReferenceLines::independent_roundings(std::size_t first, std::size_t last) const {
  if (!(options_.reference_quantum_m > 0.0)) return 1.0;
  double least_m = beams_[first].range_m;
  double most_m = least_m;
  for (std::size_t i = first; i <= last; ++i) {
    least_m = std::min(least_m, beams_[i].range_m);
    most_m = std::max(most_m, beams_[i].range_m);
  }
  const double steps = (most_m - least_m) / options_.reference_quantum_m;
  return std::clamp(steps, 1.0, static_cast<double>(last - first + 1));
}

// The last beam not to the left of a point; none where it is outside the field of view.
std::optional<std::size_t> ReferenceLines::beam_before(const Eigen::Vector2d& p_reference) const {
  const double bearing_rad = std::atan2(p_reference.y(), p_reference.x());
  const auto after =
      std::upper_bound(beams_.begin(), beams_.end(), bearing_rad,
                       [](double value, const Beam& beam) { return value < beam.bearing_rad; });
  if (after == beams_.begin() || after == beams_.end() || !(p_reference.norm() > 0.0))
    return std::nullopt;
  return static_cast<std::size_t>(after - beams_.begin()) - 1;
}

bool ReferenceLines::looks_at(const Eigen::Vector2d& p_reference) const {
  const auto first = beam_before(p_reference);
  return first && lines_[*first].status == ReferenceLine::Status::kFound;
}

ReferenceLine ReferenceLines::about(const Eigen::Vector2d& p_reference, double gate_m) const {
  const double range_m = p_reference.norm();
  const std::optional<std::size_t> before = beam_before(p_reference);
  ReferenceLine line;
  line.status = ReferenceLine::Status::kNotVisible;
  if (!before) return line;
  const std::size_t first = *before;
  // What stands clearly behind both beams is hidden, whatever they are of.
  const double nearer_m = std::min(beams_[first].range_m, beams_[first + 1].range_m);
  const double farther_m = std::max(beams_[first].range_m, beams_[first + 1].range_m);
  if (range_m > farther_m + gate_m || range_m < nearer_m - gate_m) return line;
  line.status = ReferenceLine::Status::kNoSegment;
  if (lines_[first].status != ReferenceLine::Status::kFound) return line;
  line = lines_[first];
  line.ray = p_reference / range_m;
  const Eigen::Vector2d along(-line.normal.y(), line.normal.x());
  line.sigma_off_m =
      std::hypot(line.sigma_turn_rad * along.dot(p_reference - line.point), line.bend_m);
  // A surface that the reference sees from its edge has no range to compare.
  constexpr double kSteepest = 0.17;  // 80 degrees.
  if (std::abs(line.normal.dot(line.ray)) < kSteepest)
    line.status = ReferenceLine::Status::kNoSegment;
  return line;
}

}  // namespace striper::detail
