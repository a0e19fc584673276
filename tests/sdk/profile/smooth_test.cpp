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

// Boards, corners, pipes and waves of random sizes beside each other, bends too slight to be found
// among them.
std::vector<double> mixed_ranges(const ProfileStriper& striper) {
  std::vector<double> ranges;
  while (ranges.size() < 640) {
    const auto count = static_cast<std::size_t>(testing::uniform(15.0, 120.0));
    const std::size_t from = ranges.size();
    const double kind = testing::uniform(0.0, 1.0);
    const double b0 = striper.bearing_rad(from);
    const double middle = striper.bearing_rad(from + count / 2);
    const double at = kind > 0.7 && from > 0 ? ranges.back() : testing::uniform(0.8, 2.2);
    const double turn = testing::uniform(-0.7, 0.7);
    const double radius = testing::uniform(0.05, 0.4);
    const double amplitude = kind < 0.2 ? testing::uniform(2.0, 15.0) : 0.0;  // Sigmas.
    for (std::size_t i = from; i < std::min<std::size_t>(from + count, 640); ++i) {
      const double b = striper.bearing_rad(i);
      const double across = (at + radius) * std::sin(b - middle);
      double range = range_of_line(b, turn, at * std::cos(b0 - turn));
      if (kind > 0.2 && kind < 0.4 && std::abs(across) < 0.98 * radius)
        range = (at + radius) * std::cos(b - middle) - std::sqrt(radius * radius - across * across);
      if (!(range > 0.3 && range < 6.0)) range = range_of_line(b, 0.0, 2.5);
      range +=
          amplitude * std::sin(0.12 * static_cast<double>(i - from)) * striper.sigma_m(i, range);
      ranges.push_back(range);
    }
  }
  return ranges;
}

TEST(Smoother, MixedScenesTellTheirError) {
  const ProfileStriper striper;
  Rms gain, pull;
  for (int scene = 0; scene < 500; ++scene) {
    const Errors errors = errors_of(mixed_ranges(striper), 0, 640, 1);
    gain.add(errors.gain.value());
    pull.add(errors.pull.value());
  }
  EXPECT_LT(gain.value(), 0.40);
  EXPECT_NEAR(pull.value(), 1.0, 0.05);
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
