// SPDX-License-Identifier: Apache-2.0
// Proves what is told of how a return that was measured in a gap lies among the sure ones about it.
// Does not prove how probable that makes it: bridge_rating_test.cpp.
#include "stripe/track/place_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <gtest/gtest.h>

namespace striper::detail {
namespace {

using E = BridgeEvidence;

constexpr int kGapBegin = 100;
constexpr int kGapEnd = 120;
constexpr int kLine = 104;
constexpr double kSlope = 0.1;
constexpr float kLogOdds = 7.0F;

// On a straight stripe with a gap; every fourth is bridged, those behind the gap are half as high.
SureReturns returns_until(int end) {
  SureReturns returns;
  returns.begin(static_cast<std::size_t>(end));
  for (int line = 0; line < end; ++line) {
    if (line >= kGapBegin && line < kGapEnd) continue;
    const bool is_behind = line >= kGapEnd;
    returns.add({.line = line,
                 .position = kSlope * line,
                 .sigma = 0.1,
                 .amplitude_dn = is_behind ? 40.0 : 80.0,
                 .log_odds = line == kGapEnd ? kLogOdds - 2.0F : kLogOdds,
                 .is_bridged = line % 4 == 1});
  }
  return returns;
}

// Of what was measured .2 px off, 20 DN high.
BridgeEvidence evidence_of(const SureReturns& returns) {
  BridgeEvidence e;
  const auto expected = returns.expected_at(kLine, returns.beside(kLine));
  EXPECT_TRUE(expected);
  if (expected) add_place(*expected, {kSlope * kLine + 0.2, 0.2, 20.0, 0.3}, e);
  return e;
}

TEST(PlaceEvidence, IsThatOfBothSides) {
  const BridgeEvidence e = evidence_of(returns_until(220));
  EXPECT_NEAR(e.of[E::kOffPixels], 0.2, 1e-4);
  EXPECT_NEAR(e.of[E::kOffNear], 0.2, 1e-4);
  EXPECT_NEAR(e.of[E::kOffFar], 0.2, 1e-4);
  EXPECT_NEAR(e.of[E::kFreeOff], 0.3, 1e-6);
  EXPECT_NEAR(e.of[E::kOff], 1.0, 0.05);  // The line is known far better than this was measured.
  EXPECT_NEAR(e.of[E::kNearer], std::log2(5.0), 1e-6);
  EXPECT_NEAR(e.of[E::kFarther], 4.0, 1e-6);
  EXPECT_NEAR(e.of[E::kHeight], -1.0, 1e-6);
  EXPECT_NEAR(e.of[E::kHeightStep], 1.0, 1e-6);
  EXPECT_NEAR(e.of[E::kHeightMost], std::log2(80.0 / 60.0), 1e-6);
  EXPECT_EQ(e.of[E::kAsked], 12.0F);
  EXPECT_EQ(e.of[E::kIsOneSided], 0.0F);
  EXPECT_EQ(e.of[E::kHasFar], 1.0F);
  EXPECT_EQ(e.of[E::kIsByFar], 1.0F);
  EXPECT_EQ(e.of[E::kFarPart], 1.0F);
  EXPECT_NEAR(e.of[E::kKink], 0.0, 1e-4);
  EXPECT_NEAR(e.of[E::kSureOdds], kLogOdds - 2.0F / 24.0F, 1e-5);
  EXPECT_EQ(e.of[E::kLeastSureOdds], kLogOdds - 2.0F);
  EXPECT_NEAR(e.of[E::kBridgedPart], 6.0 / 24.0, 1e-6);
}

TEST(PlaceEvidence, IsThatOfOneSideWhereTheOtherHasNone) {
  const BridgeEvidence e = evidence_of(returns_until(kGapBegin));
  EXPECT_EQ(e.of[E::kIsOneSided], 1.0F);
  EXPECT_EQ(e.of[E::kHasFar], 0.0F);
  EXPECT_EQ(e.of[E::kOffFar], 8.0F);
  EXPECT_NEAR(e.of[E::kOffNear], 0.2, 1e-4);
  EXPECT_EQ(e.of[E::kAsked], 12.0F);
  EXPECT_NEAR(e.of[E::kHeight], -2.0, 1e-6);
  EXPECT_EQ(e.of[E::kHeightStep], 0.0F);
  EXPECT_TRUE(std::all_of(e.of.begin(), e.of.end(), [](float v) { return std::isfinite(v); }));
}

}  // namespace
}  // namespace striper::detail
