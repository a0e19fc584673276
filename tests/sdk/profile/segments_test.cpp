// SPDX-License-Identifier: Apache-2.0
// Proves, on exact geometry plus the noise of docs/accuracy.md: pieces, corners, steps and ends are
// found, where they are and with true error bars; speckle is left out and corners are not; rough
// surfaces and textures are known for what they are; nothing is allocated in a stream. Rendered
// pictures and real ones are not here.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/geometry/line_fit.hpp>
#include <striper/profile/segments.hpp>

#include "support/allocation_counter.hpp"
#include "support/error_of.hpp"
#include "support/profile_scans.hpp"

namespace striper {
namespace {

using testing::ProfileStriper;
using testing::range_of_line;
using testing::Rms;

// A concave room corner at (2 m, 0), both walls `bend_rad` / 2 off the straight line.
std::vector<double> corner_ranges(const ProfileStriper& striper, double bend_rad) {
  return testing::exact_ranges(striper, [&](double b) {
    const double normal = b > 0.0 ? 0.5 * bend_rad : -0.5 * bend_rad;
    return range_of_line(b, normal, 2.0 * std::cos(normal));
  });
}

// chi2 that one straight line for all columns leaves, without noise.
double gain_of(const ProfileStriper& striper, const std::vector<double>& ranges) {
  LineSums sums;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const double b = striper.bearing_rad(i);
    sums.add(std::cos(b), std::sin(b), 1.0 / ranges[i], std::pow(striper.sigma_q(i), -2.0));
  }
  return sums.chi2();
}

TEST(Segmenter, FindsACornerWithItsErrorBar) {
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

// The bend whose chi2 gain is `gain`.
double bend_of_gain(const ProfileStriper& striper, double gain) {
  double low = 0.0;
  double high = 1.0;
  for (int round = 0; round < 40; ++round) {
    const double middle = 0.5 * (low + high);
    (gain_of(striper, corner_ranges(striper, middle)) < gain ? low : high) = middle;
  }
  return low;
}

TEST(Segmenter, MissesFewWeakCorners) {
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

struct CornerErrors {
  double over_bound;
  double pull;
};

// Of corners whose chi2 gain is `gain`.
CornerErrors corner_errors(double gain) {
  const ProfileStriper striper;
  const auto ranges = corner_ranges(striper, bend_of_gain(striper, gain));
  Segmenter segmenter;
  Segmentation found;
  PolarScan scan;
  // The bound: two lines of which each column's side is known.
  LineSums left, right;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const double b = striper.bearing_rad(i);
    (b > 0.0 ? left : right)
        .add(std::cos(b), std::sin(b), 1.0 / ranges[i], std::pow(striper.sigma_q(i), -2.0));
  }
  const LineFit l = left.solve();
  const LineFit r = right.solve();
  // Both lines pass (2, 0): dy = 2 m * dq / (difference of slopes).
  const double bound_m = 2.0 * std::sqrt(l.variance_at(1.0, 0.0) + r.variance_at(1.0, 0.0)) /
                         std::abs(l.parameters[1] - r.parameters[1]);
  Rms error, pull;
  for (int trial = 0; trial < 1500; ++trial) {
    testing::noisy_scan(striper, ranges, scan);
    segmenter.segment(scan, found);
    if (found.joints.size() != 1 || found.joints[0].kind != JointKind::kCorner) continue;
    error.add(found.joints[0].corner_m.y());
    pull.add(found.joints[0].corner_m.y() / std::sqrt(found.joints[0].covariance(1, 1)));
  }
  EXPECT_GT(error.count(), 1450);
  return {error.value() / bound_m, pull.value()};
}

TEST(Segmenter, PlacesCornersAtTheBound) {
  for (const double gain : {150.0, 300.0, 800.0}) {
    const CornerErrors errors = corner_errors(gain);
    EXPECT_LT(errors.over_bound, 1.15) << gain;
    EXPECT_NEAR(errors.pull, 1.0, 0.1) << gain;
  }
}

// The bound is of small errors: a corner that is just found may be anywhere along a tenth of the
// scan, where even the most likely bent line is 1.35 times the bound off.
TEST(Segmenter, CornersThatAreJustFoundAreNearTheBound) {
  for (const double gain : {60.0, 100.0}) {
    const CornerErrors errors = corner_errors(gain);
    EXPECT_LT(errors.over_bound, 1.3) << gain;
    EXPECT_NEAR(errors.pull, 1.0, 0.1) << gain;
  }
}

// A board of 1.2 m in front of a wall.
std::vector<double> board_ranges(const ProfileStriper& striper, double left_m, double right_m) {
  return testing::exact_ranges(striper, [&](double b) {
    const double on_board = range_of_line(b, 0.0, 1.5);
    const double y = on_board * std::sin(b);
    return y > right_m && y < left_m ? on_board : range_of_line(b, 0.0, 2.0);
  });
}

TEST(Segmenter, EndsAreKnownToAColumn) {
  const ProfileStriper striper;
  Segmenter segmenter;
  Segmentation found;
  PolarScan scan;
  Rms error, pull;
  double allowed = 0.0;
  for (int trial = 0; trial < 600; ++trial) {
    const double left = testing::uniform(0.2, 0.6);
    const double right = -testing::uniform(0.2, 0.6);
    testing::noisy_scan(striper, board_ranges(striper, left, right), scan);
    segmenter.segment(scan, found);
    ASSERT_EQ(found.pieces.size(), 3U);
    const Piece& board = found.pieces[1];
    EXPECT_EQ(found.joints[0].kind, JointKind::kStep);
    EXPECT_TRUE(board.is_begin_seen && board.is_end_seen);
    EXPECT_FALSE(found.pieces[0].is_begin_seen);
    error.add(board.begin_m.y() - left);
    error.add(board.end_m.y() - right);
    pull.add((board.begin_m.y() - left) / board.sigma_begin_m);
    pull.add((board.end_m.y() - right) / board.sigma_end_m);
    const double spacing = 1.5 / striper.focal_px;
    allowed = spacing / std::sqrt(12.0) + 0.1 * striper.sigma_m(320, 1.5);
  }
  EXPECT_LT(error.value(), allowed);
  EXPECT_NEAR(pull.value(), 1.0, 0.1);
}

TEST(Segmenter, MissesFewWeakSteps) {
  const ProfileStriper striper;
  // A step of the half scan whose chi2 gain is 60.
  const auto step_ranges = [&](double step_m) {
    return testing::exact_ranges(
        striper, [&](double b) { return range_of_line(b, 0.0, b > 0.0 ? 1.5 : 1.5 + step_m); });
  };
  double step = 0.0;
  while (gain_of(striper, step_ranges(step)) < 60.0) step += 1e-5;
  const auto ranges = step_ranges(step);
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

TEST(Segmenter, LinesHaveTrueCovariances) {
  const ProfileStriper striper;
  Segmenter segmenter;
  Segmentation found;
  PolarScan scan;
  Rms angle, distance, chi2;
  for (int trial = 0; trial < 800; ++trial) {
    const double normal = testing::uniform(-0.8, 0.8);
    const auto ranges =
        testing::exact_ranges(striper, [&](double b) { return range_of_line(b, normal, 1.2); });
    testing::noisy_scan(striper, ranges, scan);
    segmenter.segment(scan, found);
    const Piece& piece = found.pieces[0];
    angle.add((piece.line.angle_rad - normal) / std::sqrt(piece.line.covariance(0, 0)));
    distance.add((piece.line.distance_m - 1.2) / std::sqrt(piece.line.covariance(1, 1)));
    chi2.add(std::sqrt(piece.chi2 / piece.dof));
  }
  EXPECT_NEAR(angle.value(), 1.0, 0.08);
  EXPECT_NEAR(distance.value(), 1.0, 0.08);
  EXPECT_NEAR(chi2.value(), 1.0, 0.01);
}

TEST(Segmenter, SpeckleIsLeftOutAndCornersAreNot) {
  const ProfileStriper striper;
  auto ranges = board_ranges(striper, 0.4, -0.3);
  for (const std::size_t i : {50U, 51U, 200U, 320U, 500U}) ranges[i] = 0.9 + 0.001 * i;
  Segmenter segmenter;
  Segmentation found;
  PolarScan scan;
  int lost = 0;
  int right = 0;
  for (int trial = 0; trial < 100; ++trial) {
    testing::noisy_scan(striper, ranges, scan);
    segmenter.segment(scan, found);
    right += found.pieces.size() == 3U ? 1 : 0;
    for (const std::size_t i : {50U, 51U, 200U, 320U, 500U})
      EXPECT_TRUE(std::count(found.outliers.begin(), found.outliers.end(), i) == 1) << i;
    lost += static_cast<int>(found.outliers.size()) - 5;
    mark_outliers(found, scan);
    EXPECT_EQ(scan.returns[200].status, ReturnStatus::kOutlier);
    EXPECT_EQ(scan.returns[201].status, ReturnStatus::kOk);
  }
  EXPECT_GE(right, 98);
  EXPECT_LT(lost, 10);  // Of 64000 good returns.
}

TEST(Segmenter, NarrowObjectsAreNoSpeckle) {
  const ProfileStriper striper;
  auto ranges = board_ranges(striper, 0.4, -0.3);
  for (std::size_t i = 80; i < 85; ++i) ranges[i] = range_of_line(striper.bearing_rad(i), 0.0, 1.0);
  Segmenter segmenter;
  Segmentation found;
  PolarScan scan;
  int seen = 0;
  for (int trial = 0; trial < 100; ++trial) {
    testing::noisy_scan(striper, ranges, scan);
    segmenter.segment(scan, found);
    for (const Piece& piece : found.pieces) seen += piece.first == 80 && piece.last == 84 ? 1 : 0;
  }
  EXPECT_GE(seen, 90);
}

TEST(Segmenter, GrassIsRoughAndTheRoadIsNot) {
  const ProfileStriper striper;
  Segmenter segmenter;
  Segmentation found;
  PolarScan scan;
  int right = 0;
  for (int trial = 0; trial < 100; ++trial) {
    auto ranges =
        testing::exact_ranges(striper, [](double b) { return range_of_line(b, 0.1, 1.5); });
    for (std::size_t i = 450; i < ranges.size(); ++i) ranges[i] += testing::normal(0.0, 0.02);
    testing::noisy_scan(striper, ranges, scan);
    segmenter.segment(scan, found);
    if (found.pieces.size() != 2) continue;
    const Piece& road = found.pieces[0];
    const Piece& grass = found.pieces[1];
    right += !road.is_rough && grass.is_rough && std::abs(static_cast<int>(grass.first) - 450) < 8;
    EXPECT_GT(grass.scale, 3.0);
  }
  EXPECT_GE(right, 85);
}

TEST(Segmenter, TextureIsEstimatedAndWidensTheBars) {
  const ProfileStriper striper;
  Segmenter segmenter;
  Segmentation found;
  PolarScan scan;
  Rms angle, texture;
  int pieces = 0;
  for (int trial = 0; trial < 300; ++trial) {
    auto ranges =
        testing::exact_ranges(striper, [](double b) { return range_of_line(b, 0.4, 1.0); });
    for (std::size_t i = 0; i < ranges.size(); ++i)
      ranges[i] += testing::normal(0.0, 0.0015) / std::cos(striper.bearing_rad(i) - 0.4);
    testing::noisy_scan(striper, ranges, scan);
    segmenter.segment(scan, found);
    pieces += static_cast<int>(found.pieces.size());
    texture.add(found.texture_m);
    angle.add((found.pieces[0].line.angle_rad - 0.4) /
              std::sqrt(found.pieces[0].line.covariance(0, 0)));
  }
  EXPECT_LE(pieces, 302);
  EXPECT_NEAR(texture.value(), 0.0015, 0.00008);
  EXPECT_NEAR(angle.value(), 1.0, 0.12);
}

TEST(Segmenter, NothingIsAllocatedInAStream) {
  const ProfileStriper striper;
  const auto ranges = board_ranges(striper, 0.4, -0.3);
  std::vector<PolarScan> scans(4);
  for (PolarScan& scan : scans) {
    testing::noisy_scan(striper, ranges, scan);
    testing::add_gross_outliers(striper, 0.02, scan);
  }
  Segmenter segmenter;
  Segmentation found;
  for (const PolarScan& scan : scans) segmenter.segment(scan, found);
  const testing::AllocationCounter counter;
  for (const PolarScan& scan : scans) segmenter.segment(scan, found);
  EXPECT_EQ(counter.count(), 0U);
}

TEST(Segmenter, ScansWithoutPiecesHaveNone) {
  Segmenter segmenter;
  Segmentation found;
  PolarScan scan;
  segmenter.segment(scan, found);
  EXPECT_TRUE(found.pieces.empty() && found.joints.empty());
  scan.returns.resize(640);
  segmenter.segment(scan, found);
  EXPECT_TRUE(found.pieces.empty());
}

TEST(SegmentOptions, AreRefusedOutsideTheirBounds) {
  SegmentOptions options;
  options.false_split_rate = 0.5;
  const Error error = testing::error_of([&] { Segmenter segmenter(options); });
  EXPECT_STREQ(error.what(), "false_split_rate is 0.5; expected 1e-6 to 0.1");
}

}  // namespace
}  // namespace striper
