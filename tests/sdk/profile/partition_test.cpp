// SPDX-License-Identifier: Apache-2.0
// Proves that the pruned partition is the best of all: beside the plain dynamic programme that
// tries every cut and fits every piece, on random scans of every kind.
#include "profile/partition.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "profile/joints.hpp"
#include "support/profile_scans.hpp"

namespace striper::detail {
namespace {

double plain_cost(const InverseRanges& ranges, std::size_t from, std::size_t to, double rough) {
  const double chi2 = fit_run(ranges, from, to).chi2;
  const auto m = static_cast<double>(to - from);
  if (to - from < kFewestOfRough || chi2 <= m) return chi2;
  return std::min(chi2, m + m * std::log(chi2 / m) + rough);
}

double plain_optimum(const InverseRanges& ranges, const Partition::Penalties& penalties) {
  std::vector<double> best(ranges.size() + 1, std::numeric_limits<double>::infinity());
  best[0] = 0.0;
  for (std::size_t to = 1; to <= ranges.size(); ++to)
    for (std::size_t from = 0; from + kFewestOfPiece <= to; ++from)
      best[to] = std::min(
          best[to], best[from] + penalties.piece + plain_cost(ranges, from, to, penalties.rough));
  return best.back();
}

double cost_of(const InverseRanges& ranges, const std::vector<std::size_t>& cuts,
               const Partition::Penalties& penalties) {
  double cost = 0.0;
  for (std::size_t k = 0; k < cuts.size(); ++k) {
    const std::size_t to = k + 1 < cuts.size() ? cuts[k + 1] : ranges.size();
    EXPECT_GE(to - cuts[k], kFewestOfPiece);
    cost += penalties.piece + plain_cost(ranges, cuts[k], to, penalties.rough);
  }
  return cost;
}

// Lines, steps, rough stretches and curves in random order.
std::vector<double> random_ranges(const testing::ProfileStriper& striper) {
  std::vector<double> ranges;
  while (ranges.size() < static_cast<std::size_t>(striper.columns)) {
    const double normal = testing::uniform(-0.9, 0.9);
    const double distance = testing::uniform(0.5, 2.5);
    const double rough = testing::uniform(0.0, 1.0) < 0.2 ? 0.02 : 0.0;
    const double bend = testing::uniform(0.0, 1.0) < 0.2 ? 0.02 : 0.0;
    const int length = static_cast<int>(testing::uniform(2.0, 60.0));
    for (int i = 0; i < length && ranges.size() < static_cast<std::size_t>(striper.columns); ++i) {
      const double b = striper.bearing_rad(ranges.size());
      ranges.push_back(testing::range_of_line(b, normal, distance) + testing::normal(0.0, rough) +
                       bend * std::sin(0.4 * i));
    }
  }
  return ranges;
}

TEST(Partition, IsTheBestOfAllWaysToCut) {
  testing::ProfileStriper striper;
  striper.columns = 180;
  Partition partition;
  InverseRanges ranges;
  PolarScan scan;
  const Partition::Penalties penalties{24.0, 20.0};
  for (int trial = 0; trial < 25; ++trial) {
    testing::noisy_scan(striper, random_ranges(striper), scan);
    ranges.take(scan, Eigen::Vector2d::Zero());
    const double cost = cost_of(ranges, partition.cut(ranges, penalties), penalties);
    EXPECT_NEAR(cost, plain_optimum(ranges, penalties), 1e-3);
  }
}

TEST(Partition, FewElementsAreNoPieceAndThreeAreOne) {
  testing::ProfileStriper striper;
  Partition partition;
  InverseRanges ranges;
  PolarScan scan;
  for (std::size_t count = 0; count < 6; ++count) {
    testing::noisy_scan(striper, std::vector<double>(count, 1.0), scan);
    ranges.take(scan, Eigen::Vector2d::Zero());
    EXPECT_EQ(partition.cut(ranges, {24.0, 20.0}).size(), count < kFewestOfPiece ? 0U : 1U);
  }
}

}  // namespace
}  // namespace striper::detail
