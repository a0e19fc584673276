// SPDX-License-Identifier: Apache-2.0
// Proves, on exact geometry plus the noise of docs/accuracy.md, that smoothing gains what its model
// allows, tells its own error, blurs no edge and bends with curved surfaces. Real surfaces are not
// here.
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include <striper/profile/smooth.hpp>

#include "support/allocation_counter.hpp"
#include "support/profile_scans.hpp"

namespace striper {
namespace {

using testing::ProfileStriper;
using testing::range_of_line;
using testing::Rms;

// Errors of smoothed returns over the sigma that a single column had, and over their own.
struct Errors {
  Rms gain, pull;
  double bias = 0.0;  // Mean over the sigma of a single column.
};

// @param from, to  the columns that count.
Errors errors_of(const std::vector<double>& ranges, std::size_t from, std::size_t to, int scans) {
  const ProfileStriper striper;
  Smoother smoother;
  PolarScan scan;
  Errors errors;
  std::vector<double> sums(ranges.size(), 0.0);
  for (int k = 0; k < scans; ++k) {
    testing::noisy_scan(striper, ranges, scan);
    smoother.smooth(scan);
    for (std::size_t i = from; i < to; ++i) {
      const Return& r = scan.returns[i];
      if (r.status != ReturnStatus::kOk) continue;
      const double single = striper.sigma_m(i, ranges[i]);
      errors.gain.add((r.range_m - ranges[i]) / single);
      errors.pull.add((r.range_m - ranges[i]) / r.sigma_m);
      sums[i] += (r.range_m - ranges[i]) / single / scans;
    }
  }
  for (const double bias : sums) errors.bias = std::max(errors.bias, std::abs(bias));
  return errors;
}

// Boards of 40 columns, each at another depth.
std::vector<double> staircase(const ProfileStriper& striper) {
  std::vector<double> ranges;
  for (std::size_t i = 0; i < 640; ++i) {
    const std::size_t board = i / 40;
    ranges.push_back(
        range_of_line(striper.bearing_rad(i), 0.1 * (board % 3), 1.0 + 0.3 * (board % 4)));
  }
  return ranges;
}

TEST(Smoother, PlanesOfFortyColumnsComeNearTheirBound) {
  const Errors errors = errors_of(staircase(ProfileStriper{}), 0, 640, 200);
  EXPECT_LE(errors.gain.value(), 0.26);  // The bound of a straight line: sqrt(2 / 40) = .224.
  EXPECT_NEAR(errors.pull.value(), 1.0, 0.05);
}

TEST(Smoother, EdgesAreNotBlurred) {
  const auto ranges = staircase(ProfileStriper{});
  for (std::size_t edge = 40; edge < 640; edge += 120) {
    const Errors errors = errors_of(ranges, edge - 5, edge + 5, 100);
    EXPECT_LE(errors.gain.value(), 1.05);
    EXPECT_NEAR(errors.pull.value(), 1.0, 0.15);  // 1000 errors, five of each correlated.
  }
}

TEST(Smoother, WavesAreFollowed) {
  const ProfileStriper striper;
  std::vector<double> ranges;
  for (std::size_t i = 0; i < 640; ++i) {
    const double wave = 10.0 * std::sin(2.0 * std::numbers::pi * static_cast<double>(i) / 30.0);
    ranges.push_back(1.5 + wave * striper.sigma_m(i, 1.5));
  }
  const Errors errors = errors_of(ranges, 0, 640, 100);
  EXPECT_LE(errors.gain.value(), 0.6);
  EXPECT_LT(errors.bias, 1.0);
  EXPECT_NEAR(errors.pull.value(), 1.0, 0.05);
}

TEST(Smoother, RoughPiecesAndBearingsStayAsTheyAre) {
  const ProfileStriper striper;
  std::vector<double> ranges(640, 1.5);
  for (double& range : ranges) range += testing::normal(0.0, 0.03);
  PolarScan scan;
  testing::noisy_scan(striper, ranges, scan);
  const PolarScan before = scan;
  SegmentOptions options;
  options.estimate_texture = false;
  Smoother smoother(options);
  smoother.smooth(scan);
  int same = 0;
  for (std::size_t i = 0; i < scan.returns.size(); ++i) {
    same += scan.returns[i].range_m == before.returns[i].range_m ? 1 : 0;
    EXPECT_EQ(scan.returns[i].bearing_rad, before.returns[i].bearing_rad);
  }
  EXPECT_GT(same, 600);
}

TEST(Smoother, NothingIsAllocatedInAStream) {
  const auto ranges = staircase(ProfileStriper{});
  std::vector<PolarScan> scans(6);
  for (PolarScan& scan : scans) testing::noisy_scan(ProfileStriper{}, ranges, scan);
  Smoother smoother;
  for (int k = 0; k < 3; ++k) smoother.smooth(scans[static_cast<std::size_t>(k)]);
  const testing::AllocationCounter counter;
  for (int k = 3; k < 6; ++k) smoother.smooth(scans[static_cast<std::size_t>(k)]);
  EXPECT_EQ(counter.count(), 0U);
}

}  // namespace
}  // namespace striper
