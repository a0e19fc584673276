// SPDX-License-Identifier: Apache-2.0
// Proves which sure returns are asked of a scan line, and that the lines through them say where a
// straight stripe is as well as they say: of the nearest, and of many, of which 3 of 10 may lie
// on other surfaces; and that what says little is not trusted. Does not prove what is made of it:
// bridged_gaps_test.cpp.
#include "stripe/track/sure_returns.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/robust.hpp>

#include "support/allocation_counter.hpp"
#include "support/random.hpp"

namespace striper::detail {
namespace {

constexpr int kLines = 300;
constexpr int kGapBegin = 140;
constexpr int kGapEnd = 160;
constexpr int kMiddle = 150;
constexpr double kSigma_px = 0.1;

double amplitude_dn_of(int line) { return line == kGapEnd ? 80.0 : 50.0; }
double straight(int line) { return 40.0 + 0.05 * line; }

using Course = std::function<double(int line)>;

// The stripe's position in every scan line of [first, last) but for a gap.
void see(int first, int last, const Course& position, SureReturns& returns) {
  returns.begin(kLines);
  for (int line = first; line < last; ++line) {
    if (line >= kGapBegin && line < kGapEnd) continue;
    returns.add({.line = line,
                 .position = testing::normal(position(line), kSigma_px),
                 .sigma = kSigma_px,
                 .amplitude_dn = amplitude_dn_of(line),
                 .log_odds = 9.0F,
                 .is_bridged = line % 2 == 1});
  }
}

TEST(SureReturns, AskTheNearestOnBothSides) {
  SureReturns returns;
  see(0, kLines, straight, returns);
  const SureBeside beside = returns.beside(kMiddle);
  ASSERT_EQ(beside.before.size(), 12U);
  ASSERT_EQ(beside.after.size(), 12U);
  EXPECT_EQ(beside.nearest_before().line, kGapBegin - 1);
  EXPECT_EQ(beside.nearest_after().line, kGapEnd);
  EXPECT_EQ(beside.lines_spanned(), kGapEnd - kGapBegin + 24);
  EXPECT_EQ(beside.lines_to_measured(kMiddle), 10);  // Odd ones were bridged.
  EXPECT_FALSE(beside.is_one_sided());
}

TEST(SureReturns, ASideOfThreeSaysNothing) {
  SureReturns returns;
  see(0, kGapEnd + 3, straight, returns);
  const SureBeside beside = returns.beside(kMiddle);
  EXPECT_TRUE(beside.is_one_sided());
  EXPECT_EQ(beside.size(), 12U);
  EXPECT_EQ(beside.nearest_after().line, kGapBegin - 1);
  EXPECT_FALSE(returns.far_line(kMiddle));
}

TEST(SureReturns, FewerThanEightAreOnNoLine) {
  SureReturns returns;
  see(kGapBegin - 7, kGapBegin, straight, returns);
  EXPECT_FALSE(SureReturns::near_line(kMiddle, returns.beside(kMiddle)));
  see(kGapBegin - 8, kGapBegin, straight, returns);
  EXPECT_TRUE(SureReturns::near_line(kMiddle, returns.beside(kMiddle)));
}

TEST(SureReturns, NoneAreOnNoLine) {
  SureReturns returns;
  returns.begin(kLines);
  EXPECT_EQ(returns.beside(kMiddle).size(), 0U);
  EXPECT_FALSE(returns.far_line(kMiddle));
}

constexpr int kTimes = 400;

struct Found {
  std::vector<double> near_pulls, far_pulls;
  double most_off_px = 0.0;  // Of the far line.
  int trusted = 0;
};

Found find_often(const Course& position) {
  Found found;
  SureReturns returns;
  for (int i = 0; i < kTimes; ++i) {
    see(0, kLines, position, returns);
    const auto near = SureReturns::near_line(kMiddle, returns.beside(kMiddle));
    const auto far = returns.far_line(kMiddle);
    if (!near || !far) return {};
    const double off_px = std::abs(far->position - straight(kMiddle));
    found.near_pulls.push_back(std::abs(near->position - straight(kMiddle)) / near->sigma);
    found.far_pulls.push_back(off_px / far->sigma);
    found.trusted += is_trusted(*far) ? 1 : 0;
    found.most_off_px = std::max(found.most_off_px, off_px);
  }
  return found;
}

TEST(SureReturns, SayWhereAStraightStripeIs) {
  testing::reseed();
  Found found = find_often(straight);
  ASSERT_FALSE(found.far_pulls.empty());
  EXPECT_NEAR(robust_sigma(found.near_pulls), 1.0, 0.2);
  EXPECT_NEAR(robust_sigma(found.far_pulls), 1.0, 0.2);
  EXPECT_LT(found.most_off_px, 0.1);
  EXPECT_EQ(found.trusted, kTimes);
}

// From so far on either side the stripe lies on a wall behind.
Course before_a_wall(int from) {
  return
      [from](int line) { return straight(line) + (std::abs(line - kMiddle) > from ? 12.0 : 0.0); };
}

TEST(SureReturns, OfManySayItBeforeAWallBehindToo) {
  testing::reseed();
  const Found found = find_often(before_a_wall(65));
  ASSERT_FALSE(found.far_pulls.empty());
  EXPECT_LT(found.most_off_px, 0.2);
  EXPECT_EQ(found.trusted, kTimes);
}

TEST(SureReturns, OfManyAreNotTrustedWhereTooManyLieBehind) {
  testing::reseed();
  const Found found = find_often(before_a_wall(55));  // 36 %.
  ASSERT_FALSE(found.far_pulls.empty());
  EXPECT_LT(found.most_off_px, 0.2);
  EXPECT_EQ(found.trusted, 0);
}

// Half a stripe on either of two surfaces is on no line, and says so.
TEST(SureReturns, OfManyOnTwoSurfacesAreNotTrusted) {
  testing::reseed();
  SureReturns returns;
  see(
      0, kLines, [](int line) { return straight(line) + (line < kMiddle ? 0.0 : 5.0); }, returns);
  const auto far = returns.far_line(kMiddle);
  ASSERT_TRUE(far);
  EXPECT_GT(far->scatter, 16.0);
  EXPECT_FALSE(is_trusted(*far));
  EXPECT_FALSE(returns.expected_at(kMiddle, returns.beside(kMiddle)));
}

// Few lie behind the gap, a little off: a line through all of them fits, but one side alone says
// so.
TEST(SureReturns, OfOneSideAloneAreNotTrusted) {
  testing::reseed();
  SureReturns returns;
  const auto a_little_off = [](int line) { return straight(line) + (line < kMiddle ? 0.0 : 0.6); };
  see(0, kGapEnd + 5, a_little_off, returns);
  const auto far = returns.far_line(kMiddle);
  ASSERT_TRUE(far);
  EXPECT_EQ(far->part_on, 1.0);
  EXPECT_LT(far->scatter, 4.0);
  EXPECT_EQ(far->bears, 3U);  // Odd ones were bridged.
  EXPECT_FALSE(is_trusted(*far));
}

TEST(SureReturns, ExpectTheStripeOnALineOfBothSides) {
  testing::reseed();
  SureReturns returns;
  see(0, kLines, before_a_wall(65), returns);
  const auto expected = returns.expected_at(kMiddle, returns.beside(kMiddle));
  ASSERT_TRUE(expected);
  ASSERT_TRUE(expected->far);
  EXPECT_EQ(expected->position, expected->far->position);
  EXPECT_NEAR(expected->position, straight(kMiddle), 0.2);
  EXPECT_DOUBLE_EQ(expected->most_amplitude_dn, 80.0);
  EXPECT_NEAR(expected->amplitude_dn, 51.25, 1e-9);
}

// Of one side alone no farther than 8 scan lines from what was measured: of these the last is even.
TEST(SureReturns, ExpectTheStripeNearOneSideAlone) {
  testing::reseed();
  SureReturns returns;
  see(0, kGapBegin, straight, returns);
  const auto expected_at = [&](int line) {
    return returns.expected_at(line, returns.beside(line));
  };
  ASSERT_TRUE(expected_at(kGapBegin + 6));
  EXPECT_NEAR(expected_at(kGapBegin + 6)->position, straight(kGapBegin + 6), 0.3);
  EXPECT_FALSE(expected_at(kGapBegin + 7));
}

TEST(SureReturns, AllocateNothing) {
  SureReturns returns;
  returns.begin(kLines);
  const testing::AllocationCounter counter;
  see(0, kLines, straight, returns);
  EXPECT_TRUE(returns.far_line(kMiddle));
  EXPECT_EQ(counter.count(), 0U);
}

}  // namespace
}  // namespace striper::detail
