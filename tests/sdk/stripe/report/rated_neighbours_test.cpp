// SPDX-License-Identifier: Apache-2.0
// Proves what is told of a return by those about it: how far it lies off the line of those that
// are sure, whatever the line's slope, on both sides and on one; how sure they are and how far away
// the sure ones; that what is not nearly sure makes no line, nor the return itself its own; that
// binned images count in their own pixels; and that no memory is allocated per frame. What is made
// of it is proven in return_confidence_test.cpp.
#include "stripe/report/rated_neighbours.hpp"

#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "support/allocation_counter.hpp"

namespace striper::detail {
namespace {

constexpr std::size_t kLines = 100;
constexpr std::size_t kOwn = 50;
constexpr float kSureOdds = 6.0F;
constexpr float kDoubtful = 1.0F;
constexpr float kSigma_px = 0.05F;
constexpr float kRight_px = 0.5F;

// A straight stripe of which all is sure.
class Rated : public ::testing::Test {
 protected:
  explicit Rated(double slope = 0.0) : odds_(kLines, kSureOdds) {
    stripe_.resize(static_cast<int>(kLines));
    for (std::size_t line = 0; line < kLines; ++line) {
      stripe_.across_px[line] = 200.0 + slope * static_cast<double>(line);
      stripe_.sigma_px[line] = kSigma_px;
    }
  }

  void forget(std::size_t first, std::size_t last) {
    for (std::size_t line = first; line <= last; ++line) {
      odds_[line] = kNoReturn;
      stripe_.across_px[line] = std::nan("");
    }
  }
  void move(std::size_t first, std::size_t last, double by_px) {
    for (std::size_t line = first; line <= last; ++line) stripe_.across_px[line] += by_px;
  }
  // What is told of one.
  float told(Evidence::Kind kind, std::size_t line = kOwn) {
    neighbours_.hear(stripe_, odds_);
    Evidence evidence;
    neighbours_.add_to(evidence, line);
    return evidence.of[kind];
  }

  Stripe stripe_;
  std::vector<float> odds_;
  RatedNeighbours neighbours_;
};

class RatedOnASlope : public Rated {
 protected:
  RatedOnASlope() : Rated(0.4) {}
};
using RatedNeighboursOfALine = Rated;
using RatedNeighboursOfASlope = RatedOnASlope;

constexpr float kLogTolerance = 0.03F;

TEST_F(RatedNeighboursOfALine, TellHowFarAReturnLiesOffThem) {
  EXPECT_LT(told(Evidence::kFourthOffNear), -5.0F);
  move(kOwn, kOwn, 2.0);
  odds_[kOwn] = kDoubtful;
  for (const auto kind : {Evidence::kFourthOffNear, Evidence::kFourthOffFar,
                          Evidence::kFourthOffOneSide, Evidence::kFourthOffOther})
    EXPECT_NEAR(told(kind), std::log2(2.0F / kRight_px), kLogTolerance);
  stripe_.sigma_px[kOwn] = 1.0F;  // Three of which are right.
  EXPECT_NEAR(told(Evidence::kFourthOffNear), std::log2(2.0F / 3.0F), kLogTolerance);
}

TEST_F(RatedNeighboursOfASlope, TellTheSame) {
  EXPECT_LT(told(Evidence::kFourthOffNear), -3.0F);
  EXPECT_LT(told(Evidence::kFourthOffOther), 0.0F);
  EXPECT_LT(told(Evidence::kFourthScatterFar), std::log2(0.2F));  // Of the slope that is left.
  move(kOwn, kOwn, -2.0);
  EXPECT_NEAR(told(Evidence::kFourthOffNear), 2.0F, kLogTolerance);
  EXPECT_NEAR(told(Evidence::kFourthOffFar), 2.0F, kLogTolerance);
}

TEST_F(RatedNeighboursOfALine, TellOfAStepThatOneSideGoesOn) {
  move(0, kOwn - 1, 8.0);
  EXPECT_LT(told(Evidence::kFourthOffOneSide), -5.0F);
  EXPECT_NEAR(told(Evidence::kFourthOffOther), std::log2(8.0F / kRight_px), kLogTolerance);
}

TEST_F(RatedNeighboursOfALine, TellOfAnEndThatOneSideHasNone) {
  forget(0, kOwn - 1);
  EXPECT_LT(told(Evidence::kFourthOffOneSide), -5.0F);
  EXPECT_EQ(told(Evidence::kFourthOffOther), Evidence::kUnknown);
}

TEST_F(RatedNeighboursOfALine, MakeNoLineOfWhatIsNotNearlySure) {
  EXPECT_GT(told(Evidence::kFourthLineNear), 11.0F);
  EXPECT_LE(told(Evidence::kFourthLineNear), 12.0F);
  EXPECT_GT(told(Evidence::kFourthLineFar), 30.0F);
  odds_.assign(kLines, kDoubtful);
  odds_[kOwn] = kSureOdds;
  EXPECT_EQ(told(Evidence::kFourthLineNear), 0.0F);
  EXPECT_EQ(told(Evidence::kFourthOffNear), Evidence::kUnknown);
  EXPECT_EQ(told(Evidence::kFourthOffOneSide), Evidence::kUnknown);
}

TEST_F(RatedNeighboursOfALine, TellHowMuchTheyScatter) {
  EXPECT_LT(told(Evidence::kFourthScatterFar), -6.0F);
  const float odd = told(Evidence::kFourthOddFar);
  for (std::size_t line = 0; line < kLines; ++line) {
    if (line != kOwn) stripe_.across_px[line] += line % 2 == 0 ? 0.4 : -0.4;
  }
  EXPECT_NEAR(told(Evidence::kFourthScatterFar), std::log2(0.4F), 0.1F);
  move(kOwn, kOwn, 1.0);
  EXPECT_NEAR(told(Evidence::kFourthOddFar), std::log2(1.0F / 0.5F), 0.15F);
  EXPECT_LT(odd, 0.0F);
}

TEST_F(RatedNeighboursOfALine, TellHowSureTheyAre) {
  odds_[kOwn - 1] = -2.0F;
  odds_[kOwn] = kDoubtful;
  forget(kOwn + 1, kOwn + 3);
  EXPECT_EQ(told(Evidence::kFourth), kDoubtful);
  EXPECT_NEAR(told(Evidence::kFourthBeside), (6.0F - 2.0F + 1.0F - 18.0F) / 5.0F, 1e-5F);
  EXPECT_NEAR(told(Evidence::kFourthNear), (8 * 6.0F - 2.0F + 1.0F - 27.0F) / 13.0F, 1e-5F);
  EXPECT_NEAR(told(Evidence::kFourthFar), (28 * 6.0F - 2.0F + 1.0F - 27.0F) / 33.0F, 1e-5F);
  EXPECT_NEAR(told(Evidence::kFourthBefore), 1.0F, kLogTolerance);
  EXPECT_NEAR(told(Evidence::kFourthAfter), 2.0F, kLogTolerance);
  EXPECT_NEAR(told(Evidence::kFourthCoverage), 0.95F, 1e-5F);
  EXPECT_NEAR(told(Evidence::kFourthMean), 0.95F + 0.0085F - 95 * 0.0025F / 100, 1e-3F);
}

TEST_F(RatedNeighboursOfALine, AreFewerAtTheImagesEnds) {
  EXPECT_NEAR(told(Evidence::kFourthBeside, 0), kSureOdds, 1e-5F);
  EXPECT_NEAR(told(Evidence::kFourthBefore, 0), std::log2(200.0F), kLogTolerance);
  EXPECT_LE(told(Evidence::kFourthLineNear, kLines - 1), 6.0F);
  EXPECT_EQ(told(Evidence::kFourthOffOther, kLines - 1), Evidence::kUnknown);
  EXPECT_LT(told(Evidence::kFourthOffOneSide, kLines - 1), -5.0F);
}

TEST_F(RatedNeighboursOfALine, CountInTheImagesOwnPixels) {
  stripe_.axis = StripeAxis::kColumns;
  stripe_.grid.v.step = 2.0;
  move(kOwn, kOwn, 2.0);
  EXPECT_NEAR(told(Evidence::kFourthOffNear), std::log2(1.0F / kRight_px), kLogTolerance);
  stripe_.sigma_px[kOwn] = 1.0F;  // Half a pixel of these.
  EXPECT_NEAR(told(Evidence::kFourthOffNear), std::log2(1.0F / 1.5F), kLogTolerance);
}

TEST_F(RatedNeighboursOfALine, AreNoneOfAFrameThatWasNotHeard) {
  neighbours_.hear(stripe_, odds_);
  neighbours_.begin(kLines);
  Evidence evidence;
  neighbours_.add_to(evidence, kOwn);
  EXPECT_EQ(evidence.of[Evidence::kFourth], kNoReturn);
  EXPECT_EQ(evidence.of[Evidence::kFourthOffFar], Evidence::kUnknown);
  EXPECT_EQ(evidence.of[Evidence::kFourthCoverage], 0.0F);
}

TEST_F(RatedNeighboursOfALine, AllocateNothingPerFrame) {
  neighbours_.hear(stripe_, odds_);
  const testing::AllocationCounter allocations;
  neighbours_.hear(stripe_, odds_);
  EXPECT_EQ(allocations.count(), 0U);
}

}  // namespace
}  // namespace striper::detail
