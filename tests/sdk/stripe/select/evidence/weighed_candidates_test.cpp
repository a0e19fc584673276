// SPDX-License-Identifier: Apache-2.0
// Proves which candidates WeighedCandidates takes for the rivals and the neighbours of one, and
// what is said of a frame without candidates. Does not prove what the forests make of it.
#include "stripe/select/evidence/weighed_candidates.hpp"

#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "stripe/select/evidence/evidence.hpp"
#include "stripe/select/piece_traits.hpp"
#include "support/allocation_counter.hpp"
#include "support/peaks_of_a_frame.hpp"

namespace striper::detail {
namespace {

using testing::Peak;
using testing::PeaksOfAFrame;

// Two things side by side over ten scan lines: candidates 2 * line and 2 * line + 1.
std::vector<Peak> two_lines() {
  std::vector<Peak> peaks;
  for (int line = 0; line < 10; ++line) {
    peaks.push_back({line, 50.0});
    peaks.push_back({line, 90.0});
  }
  return peaks;
}

class TwoLines : public ::testing::Test {
 protected:
  TwoLines() : odds_(frame_.pieces().size()) {
    for (std::size_t i = 0; i < odds_.size(); ++i) odds_[i] = i % 2 == 0 ? 2.0F : -1.0F;
  }

  PeaksOfAFrame frame_{12, two_lines()};
  std::vector<float> odds_;
  WeighedCandidates weighed_;
};

TEST_F(TwoLines, AreEachOthersRivals) {
  odds_[6] = 4.0F;
  weighed_.sum_up(frame_.pieces(), odds_);
  ASSERT_EQ(frame_.pieces().size(), 20U);
  EXPECT_EQ(weighed_.rival(4), -1.0F);
  EXPECT_EQ(weighed_.rival(5), 2.0F);
  EXPECT_EQ(weighed_.rival(7), 4.0F);
}

TEST_F(TwoLines, HaveTheirPiecesMeans) {
  odds_[0] = 12.0F;
  weighed_.sum_up(frame_.pieces(), odds_);
  const auto piece_of = [&](std::size_t i) {
    return static_cast<std::size_t>(frame_.pieces().link(i).piece);
  };
  ASSERT_NE(piece_of(0), piece_of(1));
  EXPECT_NEAR(weighed_.of_piece(piece_of(18)), 3.0F, 1e-5F);
  EXPECT_NEAR(weighed_.rival_of_piece(piece_of(18)), -1.0F, 1e-5F);
  EXPECT_NEAR(weighed_.of_piece(piece_of(1)), -1.0F, 1e-5F);
  EXPECT_NEAR(weighed_.rival_of_piece(piece_of(1)), 3.0F, 1e-5F);
}

TEST_F(TwoLines, ThinkOfTheirNeighboursNotOfThemselves) {
  odds_[8] = -20.0F;
  weighed_.sum_up(frame_.pieces(), odds_);
  EXPECT_NEAR(weighed_.near(8), 2.0F, 1e-5F);
  EXPECT_NEAR(weighed_.near_rival(8), -1.0F, 1e-5F);
  EXPECT_LT(weighed_.near(10), 0.0F);
}

TEST_F(TwoLines, CoverTheScanLinesThatShowThem) {
  weighed_.sum_up(frame_.pieces(), odds_);
  EXPECT_NEAR(weighed_.coverage(), 10.0F / 12.0F * logistic(2.0F), 1e-5F);
  EXPECT_EQ(weighed_.best_of_line(frame_.pieces(), 3), 2.0F);
  EXPECT_EQ(weighed_.best_of_line(frame_.pieces(), 11), Evidence::kUnknown);
  EXPECT_EQ(weighed_.best_of_line(frame_.pieces(), -1), Evidence::kUnknown);
  EXPECT_EQ(weighed_.best_of_line(frame_.pieces(), 12), Evidence::kUnknown);
}

TEST_F(TwoLines, HaveALineOfTheRival) {
  weighed_.sum_up(frame_.pieces(), odds_);
  EXPECT_GT(weighed_.lines(4).near, weighed_.lines(5).near);
  EXPECT_EQ(weighed_.lines_of_rivals(frame_.pieces(), 5).near, weighed_.lines(4).near);
}

TEST_F(TwoLines, AllocateNothingOnceThereIsRoom) {
  weighed_.reserve(frame_.pieces());
  const testing::AllocationCounter counter;
  weighed_.sum_up(frame_.pieces(), odds_);
  EXPECT_EQ(counter.count(), 0U);
}

TEST(WeighedCandidates, APeakAloneHasNoRival) {
  const PeaksOfAFrame frame(5, {{2, 50.0}, {4, 90.0}});
  WeighedCandidates weighed;
  weighed.sum_up(frame.pieces(), {1.0F, -6.0F});
  EXPECT_EQ(weighed.rival(0), Evidence::kUnknown);
  EXPECT_EQ(weighed.near(0), Evidence::kUnknown);
  EXPECT_FALSE(weighed.is_hopeless(0));
  EXPECT_TRUE(weighed.is_hopeless(1));
}

TEST(WeighedCandidates, APixelBesideIsAnotherPeakOfTheSameThing) {
  for (const double apart : {1.0, 10.0}) {
    const PeaksOfAFrame frame(8, {{2, 50.0}, {2, 50.0 + apart}, {3, 50.0 + apart}});
    WeighedCandidates weighed;
    weighed.sum_up(frame.pieces(), {1.0F, 2.0F, 1.0F});
    ASSERT_GT(weighed.lines(1).near, 0.0F);
    const float of_rivals = weighed.lines_of_rivals(frame.pieces(), 0).near;
    EXPECT_EQ(of_rivals, apart > 3.0 ? weighed.lines(1).near : 0.0F);
  }
}

TEST(WeighedCandidates, AFrameWithoutAnyShowsNothing) {
  const PeaksOfAFrame frame(5, {});
  WeighedCandidates weighed;
  weighed.sum_up(frame.pieces(), {});
  EXPECT_LT(weighed.coverage(), 1e-6F);
}

}  // namespace
}  // namespace striper::detail
