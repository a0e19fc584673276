// SPDX-License-Identifier: Apache-2.0
// Proves, on exact geometry plus noise: a face of which a few returns are left, speckle between
// them, keeps them (the outlier gate), and where it does not it is found among what the gate took
// (SparseFace), for scans in either sense; speckle alone is no face. How exact curbs are so:
// curb_bound_test.cpp.
#include "detect/curb/sparse_face.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "profile/inverse_ranges.hpp"
#include "profile/outlier_gate.hpp"
#include "support/road_scans.hpp"

namespace striper {
namespace {

using testing::RoadStriper;

constexpr double kFoot_m = 3.0;
constexpr double kHeight_m = 0.05;

// A curb of a dozen returns, of which those at these places from its foot are left, and speckle.
struct Curb {
  RoadStriper road;
  PolarScan scan;
  std::vector<std::size_t> face;  // All of its returns.
  ScanLine road_line, top_line;

  Curb() {
    road.striper.row_sigma_px = 0.05;
    road_line = level_line(0.0);
    top_line = level_line(kHeight_m);
    const auto profile = testing::curb_profile(kFoot_m, kHeight_m);
    road_scan(road, ranges_of_profile(road, profile), scan);
    for (std::size_t i = 0; i < scan.returns.size(); ++i) {
      const double elevation = road.striper.bearing_rad(i) - road.down_rad;
      const double foot = std::atan2(-road.height_m, kFoot_m);
      const double edge = std::atan2(kHeight_m - road.height_m, kFoot_m);
      if (elevation > foot && elevation < edge) face.push_back(i);
    }
  }

  ScanLine level_line(double height_m) const {
    ScanLine line;
    line.angle_rad = road.up_rad() + std::numbers::pi;
    line.distance_m = road.height_m - height_m;
    return line;
  }

  void keep(std::initializer_list<std::size_t> kept) {
    for (std::size_t k = 0; k < face.size(); ++k) {
      if (std::find(kept.begin(), kept.end(), k) == kept.end())
        scan.returns[face[k]].status = ReturnStatus::kNoStripe;
    }
  }

  void displace(std::size_t k, double range_m) {
    Return& r = scan.returns[face[k]];
    r.x_m *= range_m / r.range_m;
    r.y_m *= range_m / r.range_m;
    r.range_m = range_m;
  }

  detail::InverseRanges ranges() const {
    detail::InverseRanges ranges;
    ranges.take(scan, {0.0, 0.0});
    return ranges;
  }

  // Road and top as they are; no face so far.
  detail::SparseFace::Known known() const { return {&road_line, &top_line, nullptr}; }

  Eigen::Vector2d up() const { return {std::cos(road.up_rad()), std::sin(road.up_rad())}; }
};

TEST(OutlierGate, KeepsTheReturnsOfAFaceWithFew) {
  int faces_lost = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Curb curb;
    ASSERT_GE(curb.face.size(), 9U);
    curb.keep({1, 2, 4, 5, 7});
    curb.displace(4, testing::uniform(0.5, 2.0));
    const detail::InverseRanges ranges = curb.ranges();
    detail::OutlierGate gate;
    const std::vector<char>& marked = gate.mark(ranges);
    int lost = 0;
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      const auto at = std::find(curb.face.begin(), curb.face.end(), ranges.index[i]);
      if (at == curb.face.end()) continue;
      if (at - curb.face.begin() == 4)
        EXPECT_TRUE(marked[i]) << trial;
      else
        lost += marked[i];
    }
    faces_lost += lost > 1 ? 1 : 0;
  }
  EXPECT_LE(faces_lost, 20);  // Which SparseFace finds.
}

class SparseFaces : public ::testing::TestWithParam<bool> {};

TEST_P(SparseFaces, AreFoundAmongSpeckle) {
  testing::Rms pull;
  int found = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Curb curb;
    curb.keep({0, 2, 4, 6, 8});
    curb.displace(2, testing::uniform(0.5, 2.0));
    curb.displace(6, testing::uniform(3.5, 8.0));
    if (GetParam()) std::reverse(curb.scan.returns.begin(), curb.scan.returns.end());
    const detail::InverseRanges ranges = curb.ranges();
    const auto between = [&](std::size_t i) {
      const std::size_t index =
          GetParam() ? curb.scan.returns.size() - 1 - ranges.index[i] : ranges.index[i];
      return std::find(curb.face.begin(), curb.face.end(), index) != curb.face.end();
    };
    std::size_t from = 0;
    while (!between(from)) ++from;
    detail::SparseFace face;
    const auto line = face.find(ranges, from, from + 5, curb.known());
    if (!line) continue;
    ++found;
    const Eigen::Vector2d out(curb.up().y(), -curb.up().x());
    const Eigen::Vector2d foot = kFoot_m * out - curb.road.height_m * curb.up();
    pull.add(line->offset_m(foot) / std::sqrt(line->offset_variance_m2(foot)));
  }
  EXPECT_GE(found, 290);  // The third lies beyond three sigmas in 1.4 %.
  EXPECT_NEAR(pull.value(), 1.0, 0.15);
}

INSTANTIATE_TEST_SUITE_P(EitherSense, SparseFaces, ::testing::Values(false, true));

TEST(SparseFace, IsNoneOfSpeckleAlone) {
  int found = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Curb curb;
    curb.keep({0, 2, 4, 6});
    for (const std::size_t k : {0U, 2U, 4U, 6U}) curb.displace(k, testing::uniform(0.5, 8.0));
    const detail::InverseRanges ranges = curb.ranges();
    std::size_t from = 0;
    while (ranges.index[from] != curb.face.front()) ++from;
    detail::SparseFace face;
    found += face.find(ranges, from, from + 4, curb.known()) ? 1 : 0;
  }
  EXPECT_LE(found, 6);  // Three in a row, by chance.
}

TEST(SparseFace, IsNoneWhereThereAreTooFewOrTooMany) {
  Curb curb;
  const detail::InverseRanges ranges = curb.ranges();
  detail::SparseFace face;
  EXPECT_FALSE(face.find(ranges, 5, 7, curb.known()));
  EXPECT_FALSE(face.find(ranges, 7, 5, curb.known()));
  EXPECT_FALSE(face.find(ranges, 0, detail::SparseFace::kMost + 1, curb.known()));
}

}  // namespace
}  // namespace striper
