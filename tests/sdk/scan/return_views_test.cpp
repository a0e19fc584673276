// SPDX-License-Identifier: Apache-2.0
// Proves that a scan's columns and its ok returns are the returns' own numbers, in order, without a
// copy, and that the standard's algorithms take them.
#include <algorithm>
#include <cmath>
#include <ranges>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <striper/scan/polar_scan.hpp>

#include "support/allocation_counter.hpp"
#include "support/made_scans.hpp"

namespace striper {
namespace {

static_assert(std::ranges::random_access_range<ReturnColumn>);
static_assert(std::ranges::sized_range<ReturnColumn>);
static_assert(std::ranges::view<ReturnColumn> && std::ranges::borrowed_range<ReturnColumn>);
static_assert(std::ranges::forward_range<OkReturns>);
static_assert(std::ranges::view<OkReturns> && std::ranges::borrowed_range<OkReturns>);

TEST(ReturnColumn, IsTheReturnsOwnNumbers) {
  const PolarScan scan = testing::made_scan(1);
  const std::vector<std::pair<ReturnColumn, double Return::*>> columns{
      {scan.bearing_rad(), &Return::bearing_rad},
      {scan.range_m(), &Return::range_m},
      {scan.x_m(), &Return::x_m},
      {scan.y_m(), &Return::y_m},
      {scan.sigma_m(), &Return::sigma_m},
      {scan.column(&Return::u_px), &Return::u_px}};
  for (const auto& [column, number] : columns) {
    ASSERT_EQ(column.size(), scan.returns.size());
    std::size_t i = 0;
    for (const double& value : column) EXPECT_EQ(&value, &(scan.returns.at(i++).*number));
    EXPECT_EQ(i, scan.returns.size());
  }
}

TEST(ReturnColumn, IsWalkedAsAnyArray) {
  const PolarScan scan = testing::made_scan(1, 5);
  const ReturnColumn u_px = scan.column(&Return::u_px);
  auto it = u_px.begin();
  EXPECT_EQ(*(it + 3), 3.0);
  EXPECT_EQ(it[4], 4.0);
  EXPECT_EQ(*it++, 0.0);
  EXPECT_EQ(*--it, 0.0);
  EXPECT_EQ(u_px.end() - it, 5);
  EXPECT_LT(it, u_px.end());
  EXPECT_EQ(u_px[2], 2.0);
#ifndef __clang__  // Version 14 cannot compile the views of libstdc++.
  EXPECT_EQ(std::ranges::max(u_px | std::views::take(4)), 3.0);
#endif
}

TEST(OkReturns, AreThoseOfStatusOkInOrder) {
  const PolarScan scan = testing::made_scan(1);
  std::vector<const Return*> expected;
  for (const Return& one : scan.returns) {
    if (one.status == ReturnStatus::kOk) expected.push_back(&one);
  }
  ASSERT_GT(expected.size(), 1U);
  ASSERT_LT(expected.size(), scan.returns.size());
  std::vector<const Return*> seen;
  for (const Return& one : scan.ok()) seen.push_back(&one);
  EXPECT_EQ(seen, expected);
  const auto widest = std::ranges::max_element(scan.ok(), {}, &Return::u_px);
  EXPECT_EQ(&*widest, expected.back());
}

TEST(OkReturns, OfNoneAreEmpty) {
  PolarScan scan;
  EXPECT_TRUE(scan.ok().empty());
  EXPECT_TRUE(scan.range_m().empty());
  scan.returns.resize(3);
  EXPECT_TRUE(scan.ok().empty());
  EXPECT_EQ(std::ranges::distance(scan.ok()), 0);
  EXPECT_TRUE(std::ranges::all_of(scan.range_m(), [](double m) { return std::isnan(m); }));
}

TEST(ReturnViews, AllocateNothing) {
  const PolarScan scan = testing::made_scan(1);
  const testing::AllocationCounter allocations;
  double sum_px = 0.0;
  for (const Return& one : scan.ok()) sum_px += one.u_px;
  for (const double value : scan.column(&Return::u_px)) sum_px += value;
  EXPECT_EQ(allocations.count(), 0U);
  EXPECT_GT(sum_px, 0.0);
}

}  // namespace
}  // namespace striper
