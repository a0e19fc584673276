// SPDX-License-Identifier: Apache-2.0
// Proves, on exact geometry plus the noise of docs/accuracy.md: pieces, steps and ends are found,
// where they are and with true error bars (corners: corner_test.cpp); speckle is left out and
// corners are not; rough surfaces and textures are known for what they are; nothing is allocated in
// a stream. Rendered images and real ones are not here.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/geometry/line_fit.hpp>
#include <striper/profile/segments.hpp>

#include "support/allocation_counter.hpp"
#include "support/error_of.hpp"
#include "support/profile_corners.hpp"
#include "support/profile_scans.hpp"

namespace striper {
namespace {

using testing::ProfileStriper;
using testing::range_of_line;
using testing::Rms;

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
  while (testing::gain_of(striper, step_ranges(step)) < 60.0) step += 1e-5;
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
