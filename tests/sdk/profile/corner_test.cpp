// SPDX-License-Identifier: Apache-2.0
// Proves, on exact geometry plus the noise of docs/accuracy.md, that corners are found and where
// they are, with true error bars: at the bound of small errors where errors are small, and where
// they are not as well as one could who knew how sharp the corner is. Corners of more than two
// surfaces are not here.
#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <striper/geometry/line_fit.hpp>
#include <striper/profile/segments.hpp>

#include "support/profile_corners.hpp"

namespace striper {
namespace {

using testing::bend_of_gain;
using testing::corner_ranges;
using testing::ProfileStriper;
using testing::Rms;

TEST(Corners, AreFoundWithTheirErrorBars) {
  const ProfileStriper striper;
  const auto ranges = corner_ranges(striper, 0.3);
  Segmenter segmenter;
  Segmentation found;
  PolarScan scan;
  Rms pull_x, pull_y;
  for (int trial = 0; trial < 800; ++trial) {
    testing::noisy_scan(striper, ranges, scan);
    segmenter.segment(scan, found);
    if (found.joints.size() != 1) continue;
    ASSERT_EQ(found.joints[0].kind, JointKind::kCorner);
    pull_x.add((found.joints[0].corner_m.x() - 2.0) / std::sqrt(found.joints[0].covariance(0, 0)));
    pull_y.add(found.joints[0].corner_m.y() / std::sqrt(found.joints[0].covariance(1, 1)));
  }
  EXPECT_GE(pull_x.count(), 796);
  EXPECT_NEAR(pull_x.value(), 1.0, 0.1);
  EXPECT_NEAR(pull_y.value(), 1.0, 0.1);
}

TEST(Corners, SharpOnesBetweenTwoColumnsAreNoSteps) {
  ProfileStriper striper;
  striper.row_sigma_px = 0.02;  // Half a column's spacing is dozens of sigmas.
  Segmenter segmenter;
  Segmentation found;
  PolarScan scan;
  int corners = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const double y_m =
        0.3 + 0.001 * trial;  // All places between two columns, which are 3 mm apart.
    testing::noisy_scan(striper, corner_ranges(striper, 1.5, y_m), scan);
    segmenter.segment(scan, found);
    const bool is_corner = found.joints.size() == 1 && found.joints[0].kind == JointKind::kCorner;
    corners += is_corner ? 1 : 0;
    if (!is_corner) continue;
    EXPECT_NEAR(found.joints[0].corner_m.x(), 2.0, 1e-3);
    EXPECT_NEAR(found.joints[0].corner_m.y(), y_m, 1e-3);
  }
  EXPECT_GE(corners, 98);
}

// What a camera sees of a corner: a lens's half pixel and a column's own width across it.
std::vector<double> blurred_corner(const ProfileStriper& striper, double bend, double y_m) {
  constexpr double kColumn_m = 0.003;
  constexpr double kBlur_m = 0.58 * kColumn_m;
  std::vector<double> q;
  double weights = 0.0;
  for (int step = -12; step <= 12; ++step) {
    const double off = 0.25 * step;
    const double weight = std::exp(-0.5 * off * off);
    const std::vector<double> ranges = corner_ranges(striper, bend, y_m + off * kBlur_m);
    q.resize(ranges.size());
    for (std::size_t i = 0; i < ranges.size(); ++i) q[i] += weight / ranges[i];
    weights += weight;
  }
  for (double& one : q) one = weights / one;
  return q;
}

TEST(Corners, BlurredOnesAreOneCorner) {
  ProfileStriper striper;
  striper.row_sigma_px = 0.02;  // The blur carries columns by dozens of sigmas.
  Segmenter segmenter;
  Segmentation found;
  PolarScan scan;
  int corners = 0;
  Rms pull;
  for (int trial = 0; trial < 300; ++trial) {
    const double y_m = 0.3 + 0.0001 * trial;
    testing::noisy_scan(striper, blurred_corner(striper, 2.0, y_m), scan);
    segmenter.segment(scan, found);
    const bool is_corner = found.joints.size() == 1 && found.joints[0].kind == JointKind::kCorner;
    corners += is_corner ? 1 : 0;
    if (!is_corner) continue;
    pull.add((found.joints[0].corner_m.y() - y_m) / std::sqrt(found.joints[0].covariance(1, 1)));
  }
  EXPECT_GE(corners, 285);  // One in fifteen was cut in three.
  EXPECT_LT(pull.value(), 1.1);
  EXPECT_GT(pull.value(), 0.8);
}

TEST(Corners, WeakOnesAreSeldomMissed) {
  const ProfileStriper striper;
  const auto ranges = corner_ranges(striper, bend_of_gain(striper, 60.0));
  Segmenter segmenter;
  Segmentation found;
  PolarScan scan;
  int missed = 0;
  for (int trial = 0; trial < 800; ++trial) {
    testing::noisy_scan(striper, ranges, scan);
    segmenter.segment(scan, found);
    missed += found.joints.empty() ? 1 : 0;
  }
  EXPECT_LE(missed, 8);
}

// The bound of small errors, radians: two lines of which each column's side is known.
double bound_of(const ProfileStriper& striper, const std::vector<double>& ranges, double at_rad) {
  LineSums left, right;
  for (std::size_t i = 0; i < ranges.size(); ++i)
    testing::add_column(striper, ranges, i, striper.bearing_rad(i) > at_rad ? left : right);
  const double c = std::cos(at_rad);
  const double s = std::sin(at_rad);
  const LineFit l = left.solve();
  const LineFit r = right.solve();
  const Eigen::Vector2d bend = l.parameters - r.parameters;
  return std::sqrt(l.variance_at(c, s) + r.variance_at(c, s)) / std::abs(c * bend[1] - s * bend[0]);
}

// The mean over all places of a corner, by one who knows its chi2 gain: on average over the places
// no one is better.
double bearing_of_known_gain(const ProfileStriper& striper, const PolarScan& scan, double gain) {
  double most = -1e9;
  std::vector<double> likelihood;  // Its logarithm, of a corner at each eighth column.
  for (std::size_t knot = 8; knot + 8 < scan.returns.size(); knot += 8) {
    const double at_rad = striper.bearing_rad(knot);
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < scan.returns.size(); ++i) {
      const double turn = striper.bearing_rad(i) - at_rad;
      const Eigen::Vector3d row(std::cos(turn), std::sin(turn), turn < 0.0 ? std::sin(turn) : 0.0);
      const double weight = std::pow(striper.sigma_q(i), -2.0);
      normal += weight * row * row.transpose();
      right += weight * row / scan.returns[i].range_m;
    }
    const Eigen::Matrix3d inverse = normal.inverse();
    const Eigen::Vector3d fit = inverse * right;
    const double bend_in_sigmas = std::abs(fit[2]) / std::sqrt(inverse(2, 2));
    likelihood.push_back(0.5 * right.dot(fit) -
                         0.5 * std::pow(bend_in_sigmas - std::sqrt(gain), 2.0));
    most = std::max(most, likelihood.back());
  }
  double sum = 0.0;
  double mean = 0.0;
  for (std::size_t k = 0; k < likelihood.size(); ++k) {
    const double weight = std::exp(likelihood[k] - most);
    sum += weight;
    mean += weight * striper.bearing_rad(8 + 8 * k);
  }
  return mean / sum;
}

struct CornerErrors {
  double over_bound = 0.0;
  double pull = 0.0;
  double of_known_gain = 0.0;  // Over the bound.
};

// Of corners at (2 m, y_m) whose chi2 gain is `gain`.
// @param every  in one of so many scans the gain is also told.
CornerErrors corner_errors(double gain, double y_m, int trials, int every) {
  const ProfileStriper striper;
  const auto ranges = corner_ranges(striper, bend_of_gain(striper, gain, y_m), y_m);
  const double at_rad = std::atan2(y_m, 2.0);
  const double bound_rad = bound_of(striper, ranges, at_rad);
  Segmenter segmenter;
  Segmentation found;
  PolarScan scan;
  Rms error, pull, told;
  for (int trial = 0; trial < trials; ++trial) {
    testing::noisy_scan(striper, ranges, scan);
    segmenter.segment(scan, found);
    if (found.joints.size() != 1 || found.joints[0].kind != JointKind::kCorner) continue;
    const Joint& joint = found.joints[0];
    const double off_rad = std::atan2(joint.corner_m.y(), joint.corner_m.x()) - at_rad;
    const Eigen::Vector2d across(-std::sin(at_rad), std::cos(at_rad));
    const double sigma_m = std::sqrt(across.dot(joint.covariance * across));
    error.add(off_rad / bound_rad);
    pull.add(off_rad * joint.corner_m.norm() / sigma_m);
    if (trial % every == 0)
      told.add((bearing_of_known_gain(striper, scan, gain) - at_rad) / bound_rad);
  }
  EXPECT_GT(error.count(), trials - trials / 30);
  return {error.value(), pull.value(), told.count() > 0 ? told.value() : 0.0};
}

TEST(Corners, ArePlacedAtTheBound) {
  for (const double gain : {150.0, 300.0, 800.0}) {
    const CornerErrors errors = corner_errors(gain, 0.0, 1500, 1501);
    EXPECT_LT(errors.over_bound, 1.15) << gain;
    EXPECT_NEAR(errors.pull, 1.0, 0.1) << gain;
  }
  EXPECT_LT(corner_errors(100.0, 0.0, 1500, 1501).over_bound, 1.2);
}

// The bound is of small errors. A corner that is just found may be anywhere along a tenth of the
// scan, and then even who knows its gain is 1.18 (in the middle) to 1.32 times the bound off.
TEST(Corners, ThatAreJustFoundArePlacedAsWellAsCanBe) {
  Rms over_bound, of_known_gain;
  for (const double y_m : {-0.6, -0.3, 0.0, 0.3, 0.6}) {
    const CornerErrors errors = corner_errors(60.0, y_m, 600, 4);
    over_bound.add(errors.over_bound);
    of_known_gain.add(errors.of_known_gain);
    EXPECT_NEAR(errors.pull, 1.0, 0.1) << y_m;
  }
  EXPECT_LT(over_bound.value(), 1.3);
  EXPECT_LT(over_bound.value(), 1.07 * of_known_gain.value());
}

}  // namespace
}  // namespace striper
