// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <fmt/format.h>

#include <striper/compare/scan_comparison.hpp>
#include <striper/core/error.hpp>
#include <striper/core/robust.hpp>
#include <striper/core/statistics.hpp>

#include "compare/reference_lines.hpp"

namespace striper {
namespace {

using detail::ReferenceLine;
using detail::ReferenceLines;

// x, y, yaw of T_scan_reference, and what the reference's ranges are too short by.
using Unknowns = Eigen::Vector4d;
using Information = Eigen::Matrix4d;

constexpr int kFewestPairs = 30;
// Neighbours share their errors over about so many returns: rounding over a surface, the fit's
// line.
constexpr std::size_t kCluster = 48;
constexpr double kCauchy =
    2.385;  // 95 % efficiency where errors are normal (Holland & Welsch 1977).

Eigen::Matrix2d rotation(double angle_rad) {
  return Eigen::Rotation2Dd(angle_rad).toRotationMatrix();
}

struct Point {
  Eigen::Vector2d p_scan;
  double sigma_m;
};

// How a return stands to the reference's surface, along the surface's normal.
struct Pair {
  std::size_t point;
  Eigen::Vector4d jacobian;
  Eigen::Vector4d misled;  // What the jacobian changes by for one sigma of the line's direction.
  double residual_m;
  double sigma_m;
  double along_ray;   // Residual over the difference of range along the return's own ray.
  double rounding_m;  // Half the width of the reference's rounding in it,
  bool is_even;       // which is even over that, and not the mean of several.
};

class Matcher {
 public:
  Matcher(std::vector<Point> points, const ReferenceLines& lines, const CompareOptions& options)
      : points_(std::move(points)), lines_(lines), options_(options) {}

  std::vector<Pair> pairs(const Unknowns& at, double gate_m, DroppedReturns* dropped) const {
    std::vector<Pair> result;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (const auto pair = pair_of(i, at, gate_m, dropped)) result.push_back(*pair);
    }
    return result;
  }

  // How many points are in directions where the reference has surfaces.
  int looked_at(const Unknowns& at) const {
    const Eigen::Matrix2d to_reference = rotation(-at[2]);
    return static_cast<int>(std::count_if(points_.begin(), points_.end(), [&](const Point& point) {
      return lines_.looks_at(to_reference * (point.p_scan - at.head<2>()));
    }));
  }

  const std::vector<Point>& points() const noexcept { return points_; }
  const CompareOptions& options() const noexcept { return options_; }

 private:
  std::optional<Pair> pair_of(std::size_t index, const Unknowns& at, double gate_m,
                              DroppedReturns* dropped) const {
    const Point& point = points_[index];
    const Eigen::Matrix2d to_reference = rotation(-at[2]);
    const Eigen::Vector2d moved = point.p_scan - at.head<2>();
    const Eigen::Vector2d p_reference = to_reference * moved;
    // The reference's own points are where it says, which an offset moves along its rays.
    const double range_m = p_reference.norm();
    const Eigen::Vector2d said = p_reference * std::max(0.0, 1.0 - at[3] / range_m);
    const ReferenceLine line = lines_.about(said, gate_m);
    const double residual_m = line.normal.dot(said - line.point);
    const bool is_near = std::abs(residual_m) <= gate_m;
    if (line.status != ReferenceLine::Status::kFound || !is_near) {
      if (dropped != nullptr)
        ++(line.status == ReferenceLine::Status::kNoSegment ? dropped->no_segment
                                                            : dropped->not_visible);
      return std::nullopt;
    }
    const Eigen::Vector2d own_ray = to_reference * point.p_scan.normalized();
    Pair pair{};
    pair.point = index;
    pair.residual_m = residual_m;
    pair.along_ray = line.normal.dot(own_ray);
    const double on_ray = line.normal.dot(line.ray);
    pair.rounding_m =
        0.5 * options_.reference_quantum_m * std::abs(on_ray) / std::sqrt(line.roundings);
    pair.is_even = line.roundings < 2.0;
    const double own_m = pair.along_ray * point.sigma_m;
    const double other_m = on_ray * line.sigma_m;
    pair.sigma_m =
        std::sqrt(own_m * own_m + other_m * other_m + line.sigma_off_m * line.sigma_off_m +
                  pair.rounding_m * pair.rounding_m / 3.0);
    const auto jacobian = [&](const Eigen::Vector2d& normal) {
      Eigen::Vector4d result;
      result.head<2>() = -(normal.transpose() * to_reference).transpose();
      result[2] = normal.x() * p_reference.y() - normal.y() * p_reference.x();
      result[3] = options_.reference_offset ? -normal.dot(line.ray) : 0.0;
      return result;
    };
    pair.jacobian = jacobian(line.normal);
    const Eigen::Vector2d along(-line.normal.y(), line.normal.x());
    pair.misled = line.sigma_normal_rad * jacobian(along);
    return pair;
  }

  std::vector<Point> points_;
  const ReferenceLines& lines_;
  const CompareOptions& options_;
};

double cauchy_weight(double residual_m, double scale_m) {
  const double u = residual_m / (kCauchy * scale_m);
  return 1.0 / (1.0 + u * u);
}

// The errors' scale: at least what is stated, more while the poses are still far apart.
double scale_of(const std::vector<Pair>& pairs) {
  std::vector<double> sizes;
  sizes.reserve(pairs.size());
  for (const Pair& pair : pairs) sizes.push_back(std::abs(pair.residual_m) / pair.sigma_m);
  return std::max(1.0, robust_sigma(sizes));
}

struct Fit {
  Unknowns unknowns = Unknowns::Zero();
  double score = -1.0;  // Sum of the weights: how much agrees.
};

Information information_of(const std::vector<Pair>& pairs, double scale, bool has_offset) {
  Information sum = Information::Zero();
  for (const Pair& pair : pairs) {
    const double sigma_m = scale * pair.sigma_m;
    const double weight = cauchy_weight(pair.residual_m, sigma_m) / (sigma_m * sigma_m);
    sum += weight * pair.jacobian * pair.jacobian.transpose();
  }
  if (!has_offset) sum(3, 3) = 1.0;  // Known: it touches nothing.
  return sum;
}

// One step of Gauss-Newton; false where the pairs do not determine it.
bool improve(const std::vector<Pair>& pairs, double scale, bool has_offset, Unknowns& at) {
  const Information sum = information_of(pairs, scale, has_offset);
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  for (const Pair& pair : pairs) {
    const double sigma_m = scale * pair.sigma_m;
    gradient += cauchy_weight(pair.residual_m, sigma_m) / (sigma_m * sigma_m) * pair.residual_m *
                pair.jacobian;
  }
  const Eigen::LDLT<Information> factors(sum);
  if (factors.info() != Eigen::Success || !factors.isPositive()) return false;
  const Eigen::Vector4d step = factors.solve(gradient);
  if (!step.allFinite() || step.head<2>().norm() > 1.0) return false;
  at -= step;
  return true;
}

Fit refine(const Matcher& matcher, Unknowns at, const std::vector<double>& gates_m) {
  Fit fit;
  for (const double gate_m : gates_m) {
    const std::vector<Pair> pairs = matcher.pairs(at, gate_m, nullptr);
    if (static_cast<int>(pairs.size()) < kFewestPairs) return fit;
    if (!improve(pairs, scale_of(pairs), matcher.options().reference_offset, at)) return fit;
  }
  fit.unknowns = at;
  fit.score = 0.0;
  for (const Pair& pair : matcher.pairs(at, matcher.options().gate_m, nullptr))
    fit.score += cauchy_weight(pair.residual_m, 0.3 * matcher.options().gate_m);
  return fit;
}

// Every so many points from every start, then all of them from the best.
Fit search(const Matcher& coarse, const Matcher& fine) {
  const CompareOptions& options = fine.options();
  Fit best;
  for (const double dx : {0.0, -1.0, 1.0, -0.5, 0.5})
    for (const double dy : {0.0, -1.0, 1.0, -0.5, 0.5})
      for (const double turn : {0.0, -1.0, 1.0, -0.5, 0.5}) {
        const Unknowns start(dx * options.search_m, dy * options.search_m,
                             turn * options.search_rad, 0.0);
        const double g = options.gate_m;
        const Fit fit = refine(coarse, start, {6 * g, 4 * g, 3 * g, 2 * g, 2 * g, g, g});
        if (fit.score > best.score) best = fit;
      }
  if (best.score < 0.0) return best;
  return refine(fine, best.unknowns, std::vector<double>(15, options.gate_m));
}

// What is left of the information once that is left out which the lines' wrong directions feign:
// along a single wall it is none.
Information true_information(const std::vector<Pair>& pairs, bool has_offset) {
  Information sum = information_of(pairs, 1.0, has_offset);
  for (const Pair& pair : pairs) {
    const double weight =
        cauchy_weight(pair.residual_m, pair.sigma_m) / (pair.sigma_m * pair.sigma_m);
    sum -= weight * pair.misled * pair.misled.transpose();
  }
  return sum;
}

// H^-1 (sum of g g') H^-1, g being gradients that are summed over neighbours before they are
// squared: they share their errors, rounding and what is not straight over a whole surface. Once of
// the residuals as they are, once of what is stated; the larger counts.
Information covariance_of(const std::vector<Pair>& pairs, bool has_offset) {
  const Information information = true_information(pairs, has_offset);
  const Eigen::LLT<Information> factors(information);
  if (factors.info() != Eigen::Success)
    return Information::Constant(std::numeric_limits<double>::infinity());
  const Information inverse = factors.solve(Information::Identity());
  Information found = Information::Zero();
  Information stated = information;
  for (std::size_t first = 0; first < pairs.size(); first += kCluster) {
    Eigen::Vector4d residuals = Eigen::Vector4d::Zero();
    Eigen::Vector4d shared = Eigen::Vector4d::Zero();
    for (std::size_t i = first; i < std::min(pairs.size(), first + kCluster); ++i) {
      const Pair& pair = pairs[i];
      const double weight =
          cauchy_weight(pair.residual_m, pair.sigma_m) / (pair.sigma_m * pair.sigma_m);
      residuals += weight * pair.residual_m * pair.jacobian;
      shared += weight * std::hypot(pair.rounding_m, detail::kStraight_m) / std::sqrt(3.0) *
                pair.jacobian;
    }
    found += residuals * residuals.transpose();
    stated += shared * shared.transpose();
  }
  const Information by_residuals = inverse * found * inverse;
  Information larger = inverse * stated * inverse;
  for (int k = 0; k < 4; ++k) larger(k, k) = std::max(larger(k, k), by_residuals(k, k));
  return larger;
}

// The chance that a normal error and one even within +-`half` together are within `limit`.
double chance_within(double limit, double sigma, double half) {
  if (!(half > 0.0)) return 2.0 * normal_below(limit / sigma) - 1.0;
  if (!(sigma > 0.0)) return std::min(1.0, limit / half);
  constexpr int kSteps = 32;
  double sum = 0.0;
  for (int k = 0; k < kSteps; ++k) {
    const double even = half * ((2.0 * k + 1.0) / kSteps - 1.0);
    sum += normal_below((limit - even) / sigma) - normal_below((-limit - even) / sigma);
  }
  return sum / kSteps;
}

std::vector<ComparedReturn> compared(const Matcher& matcher, const std::vector<Pair>& pairs) {
  std::vector<ComparedReturn> result;
  for (const Pair& pair : pairs) {
    const Point& point = matcher.points()[pair.point];
    // The surface's slope to this return's own ray turns what is off it into what is off in range.
    constexpr double kSteepest = 0.1;
    const double slope = std::abs(pair.along_ray);
    if (slope < kSteepest) continue;
    ComparedReturn one;
    one.point_m = point.p_scan;
    one.bearing_rad = std::atan2(point.p_scan.y(), point.p_scan.x());
    one.range_m = point.p_scan.norm();
    one.difference_m = pair.residual_m / pair.along_ray;
    one.sigma_m = pair.sigma_m / slope;
    const double normal2 = pair.sigma_m * pair.sigma_m - pair.rounding_m * pair.rounding_m / 3.0;
    one.expected_inside =
        pair.is_even
            ? chance_within(1.96 * pair.sigma_m, std::sqrt(std::max(normal2, 0.0)), pair.rounding_m)
            : chance_within(1.96 * pair.sigma_m, pair.sigma_m, 0.0);
    result.push_back(one);
  }
  return result;
}

template <typename Value>
std::vector<ComparisonBin> bins_of(const std::vector<ComparedReturn>& pairs, Value value) {
  constexpr std::size_t kBins = 20;  // Of 5 % of the returns each.
  std::vector<const ComparedReturn*> order;
  order.reserve(pairs.size());
  for (const ComparedReturn& pair : pairs) order.push_back(&pair);
  std::sort(order.begin(), order.end(), [&](const ComparedReturn* a, const ComparedReturn* b) {
    return value(*a) < value(*b);
  });
  std::vector<ComparisonBin> bins;
  for (std::size_t k = 0; k < kBins; ++k) {
    const std::size_t first = k * order.size() / kBins;
    const std::size_t last = (k + 1) * order.size() / kBins;
    if (last <= first) continue;
    std::vector<double> differences;
    for (std::size_t i = first; i < last; ++i) differences.push_back(order[i]->difference_m);
    ComparisonBin bin{value(*order[first]), value(*order[last - 1]), static_cast<int>(last - first),
                      0.0, 0.0};
    bin.median_m = upper_median(differences);
    for (double& difference : differences) difference = std::abs(difference - bin.median_m);
    // The median of normal errors scatters by sqrt(pi / 2) more than their mean.
    bin.sigma_m = 1.2533 * robust_sigma(differences) / std::sqrt(static_cast<double>(bin.count));
    bins.push_back(bin);
  }
  return bins;
}

void add_pulls(ScanComparison& comparison) {
  double sum = 0.0;
  double sum2 = 0.0;
  int inside = 0;
  for (const ComparedReturn& pair : comparison.pairs) {
    sum += pair.pull();
    sum2 += pair.pull() * pair.pull();
    inside += std::abs(pair.pull()) <= 1.96 ? 1 : 0;
    comparison.expected_inside_1_96 += pair.expected_inside;
  }
  const auto count = static_cast<double>(comparison.pairs.size());
  comparison.pull_mean = sum / count;
  comparison.pull_sd =
      std::sqrt(std::max(0.0, sum2 / count - comparison.pull_mean * comparison.pull_mean));
  comparison.inside_1_96 = inside / count;
  comparison.expected_inside_1_96 /= count;
}

Point point_of(const Return& one) {
  const double calibration_m = std::isfinite(one.sigma_cal_m) ? one.sigma_cal_m : 0.0;
  return {one.range_m * Eigen::Vector2d(std::cos(one.bearing_rad), std::sin(one.bearing_rad)),
          std::max(1e-5, std::hypot(one.sigma_m, calibration_m))};
}

std::vector<Point> points_of(std::span<const PolarScan> scans, ReturnStatus status) {
  std::vector<Point> points;
  for (const PolarScan& scan : scans) {
    for (const Return& one : scan.returns) {
      if (one.status == status && std::isfinite(one.range_m) && std::isfinite(one.sigma_m))
        points.push_back(point_of(one));
    }
  }
  return points;
}

int returns_of(std::span<const PolarScan> scans) {
  int count = 0;
  for (const PolarScan& scan : scans) count += static_cast<int>(scan.returns.size());
  return count;
}

std::vector<StatusOutliers> outliers_of(std::span<const PolarScan> scans,
                                        const ReferenceLines& lines, const CompareOptions& options,
                                        const Unknowns& at) {
  constexpr double kOutlier = 3.0;       // Sigmas.
  constexpr double kAnywhere_m = 100.0;  // However far off.
  std::vector<StatusOutliers> result;
  for (int k = 0; k < kReturnStatusCount; ++k) {
    StatusOutliers outcome;
    outcome.status = static_cast<ReturnStatus>(k);
    const Matcher matcher(points_of(scans, outcome.status), lines, options);
    for (const Pair& pair : matcher.pairs(at, kAnywhere_m, nullptr)) {
      if (pair.residual_m < -options.gate_m) continue;  // Hidden from the reference.
      ++outcome.compared;
      outcome.outliers += std::abs(pair.residual_m) > kOutlier * pair.sigma_m ? 1 : 0;
    }
    if (outcome.compared > 0) result.push_back(outcome);
  }
  return result;
}

std::vector<Point> thinned(const std::vector<Point>& points, std::size_t most) {
  const std::size_t step = std::max<std::size_t>(1, points.size() / most);
  std::vector<Point> few;
  for (std::size_t i = 0; i < points.size(); i += step) few.push_back(points[i]);
  return few;
}

void add_pose(const Unknowns& at, const Information& covariance, bool has_offset,
              ScanComparison& comparison) {
  const Eigen::Vector4d sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  comparison.pose = {at[0], at[1], at[2], sigma[0], sigma[1], sigma[2]};
  if (has_offset) {
    comparison.reference_offset_m = at[3];
    comparison.sigma_offset_m = sigma[3];
  }
}

void require_trustworthy(const PlanarPose& pose) {
  constexpr double kMost_m = 0.1;
  constexpr double kMost_rad = 0.1;
  const double position_m = std::hypot(pose.sigma_x_m, pose.sigma_y_m);
  if (position_m < kMost_m && pose.sigma_yaw_rad < kMost_rad) return;
  throw Error(ErrorKind::kUntrustworthy,
              fmt::format("what both see does not determine where the reference stands: one sigma "
                          "is {:.3g} m and {:.3g} rad, expected below {:g} m and {:g} rad",
                          position_m, pose.sigma_yaw_rad, kMost_m, kMost_rad));
}

// A scan of another place can be laid over some surfaces too, and the pose then looks as certain.
// The paper's room agrees by 0.7 and more where a third is hidden, wrong rooms by 0.45 at most.
void require_agreement(const Fit& fit, int looked_at) {
  constexpr double kLeast = 0.55;
  const double share = looked_at > 0 ? fit.score / looked_at : 0.0;
  if (share >= kLeast) return;
  throw Error(ErrorKind::kUntrustworthy,
              fmt::format("the scans do not agree with the reference: at best {:.0f} % of the "
                          "returns where it looks lie on its surfaces, expected {:.0f} % or more",
                          100.0 * share, 100.0 * kLeast));
}

void require_positive(const char* field, double value, double most) {
  if (value >= 0.0 && value <= most) return;
  throw Error(ErrorKind::kBadValue,
              fmt::format("{} is {:g}, expected 0 to {:g}", field, value, most));
}

}  // namespace

Eigen::Vector2d PlanarPose::operator*(const Eigen::Vector2d& point) const {
  return rotation(yaw_rad) * point + Eigen::Vector2d(x_m, y_m);
}

void CompareOptions::validate() const {
  require_positive("reference_quantum_m", reference_quantum_m, 1.0);
  require_positive("reference_sigma_m", reference_sigma_m, 1.0);
  require_positive("largest_gap", largest_gap, 1.0);
  require_positive("gate_m", gate_m, 10.0);
  require_positive("search_m", search_m, 100.0);
  require_positive("search_rad", search_rad, std::numbers::pi);
}

ScanComparison compare_scans(std::span<const PolarScan> scans, const PolarScan& reference,
                             const CompareOptions& options) {
  options.validate();
  constexpr std::size_t kCoarsePoints = 200;
  ScanComparison comparison;
  const ReferenceLines lines(reference, options);
  const std::vector<Point> points = points_of(scans, ReturnStatus::kOk);
  if (points.empty())
    throw Error(ErrorKind::kBadValue, "none of the scans' ok returns has both range_m and sigma_m");
  comparison.dropped.status = returns_of(scans) - static_cast<int>(points.size());
  const Matcher fine(points, lines, options);
  const Fit fit = search(Matcher(thinned(points, kCoarsePoints), lines, options), fine);
  if (fit.score < 0.0)
    throw Error(ErrorKind::kUntrustworthy,
                fmt::format("fewer than {} returns agree with the reference, or it stands more "
                            "than {:g} m or {:g} rad away",
                            kFewestPairs, options.search_m, options.search_rad));
  const std::vector<Pair> pairs = fine.pairs(fit.unknowns, options.gate_m, &comparison.dropped);
  require_agreement(fit, fine.looked_at(fit.unknowns));
  add_pose(fit.unknowns, covariance_of(pairs, options.reference_offset), options.reference_offset,
           comparison);
  require_trustworthy(comparison.pose);
  comparison.outliers = outliers_of(scans, lines, options, fit.unknowns);
  comparison.pairs = compared(fine, pairs);
  add_pulls(comparison);
  comparison.bias_by_bearing =
      bins_of(comparison.pairs, [](const ComparedReturn& one) { return one.bearing_rad; });
  comparison.bias_by_range =
      bins_of(comparison.pairs, [](const ComparedReturn& one) { return one.range_m; });
  return comparison;
}

}  // namespace striper
