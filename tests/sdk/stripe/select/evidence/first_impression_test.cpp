// SPDX-License-Identifier: Apache-2.0
// Proves what FirstImpression makes of the first weighing: how the stripe looks, what a piece goes
// on from, and how much of the stripe the pieces that are joined have.
#include "stripe/select/evidence/first_impression.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "support/peaks_of_a_frame.hpp"

namespace striper::detail {
namespace {

using testing::Peak;
using testing::PeaksOfAFrame;

class Impression {
 public:
  Impression(const PeaksOfAFrame& frame, const std::vector<float>& odds) : frame_(frame) {
    const StripePieces& pieces = frame.pieces();
    PieceTraits traits;
    traits.sum_up(pieces, {.width = WidthModel{.at_pivot = 1.0}});
    std::vector<float> heights(pieces.size());
    for (std::size_t i = 0; i < heights.size(); ++i) heights[i] = traits.of_candidate(i).height;
    WeighedCandidates first;
    first.sum_up(pieces, odds);
    impression_.sum_up(pieces, traits, heights, first);
  }

  const FirstImpression::StripeLook& stripe() const { return impression_.stripe(); }
  const FirstImpression::PieceOdds& of_piece_with(std::size_t candidate) const {
    const std::int32_t piece = frame_.pieces().link(candidate).piece;
    return impression_.of_piece(static_cast<std::size_t>(piece));
  }

 private:
  const PeaksOfAFrame& frame_;
  FirstImpression impression_;
};

constexpr int kLines = 12;

// Heights of 16 and 64; candidates 2 * line and 2 * line + 1.
PeaksOfAFrame two_lines() {
  std::vector<Peak> peaks;
  for (int line = 0; line < 10; ++line) {
    peaks.push_back({line, 50.0, 16.0F});
    peaks.push_back({line, 90.0, 64.0F});
  }
  return {kLines, peaks};
}

TEST(FirstImpression, TheStripeLooksAsWhatIsProbable) {
  const PeaksOfAFrame frame = two_lines();
  std::vector<float> odds;
  for (int line = 0; line < 10; ++line) odds.insert(odds.end(), {3.0F, -4.0F});
  const Impression seen(frame, odds);
  EXPECT_NEAR(seen.stripe().height, 4.0F, 0.02F);
  EXPECT_NEAR(seen.stripe().width, 0.0F, 0.02F);
  EXPECT_NEAR(seen.stripe().coverage, 10.0F / kLines * logistic(3.0F), 1e-4F);
  EXPECT_NEAR(seen.stripe().runner_up, 10.0F / kLines * logistic(-4.0F), 1e-4F);
}

TEST(FirstImpression, NothingProbableHasNoLook) {
  const PeaksOfAFrame frame = two_lines();
  const Impression seen(frame, std::vector<float>(frame.pieces().size(), -5.0F));
  EXPECT_EQ(seen.stripe().coverage, 0.0F);
  EXPECT_EQ(seen.stripe().height, 0.0F);
}

TEST(FirstImpression, APieceGoesOnFromTheScanLineBeforeIt) {
  std::vector<Peak> peaks{{2, 20.0}};
  for (int line = 3; line < 9; ++line) peaks.push_back({line, 80.0});
  const PeaksOfAFrame frame(kLines, peaks);
  std::vector<float> odds(peaks.size(), 1.0F);
  odds[0] = 1.5F;
  const Impression seen(frame, odds);
  EXPECT_EQ(seen.of_piece_with(3).before, 1.5F);
  EXPECT_EQ(seen.of_piece_with(3).after, Evidence::kUnknown);
  EXPECT_EQ(seen.of_piece_with(0).after, 1.0F);
}

TEST(FirstImpression, DashesOfALineAreJoined) {
  std::vector<Peak> peaks;
  for (const int line : {0, 1, 2, 3, 4, 15, 16, 17, 18, 19}) peaks.push_back({line, 50.0});
  const PeaksOfAFrame frame(20, peaks);
  std::vector<float> odds(peaks.size(), 2.0F);
  for (std::size_t i = 5; i < odds.size(); ++i) odds[i] = -1.0F;
  ASSERT_EQ(frame.pieces().pieces().size(), 2U);
  const Impression seen(frame, odds);
  const float joined = 5.0F * (logistic(2.0F) + logistic(-1.0F));
  EXPECT_NEAR(seen.of_piece_with(0).joined, joined, 1e-4F);
  EXPECT_NEAR(seen.of_piece_with(9).joined, joined, 1e-4F);
  EXPECT_NEAR(seen.of_piece_with(0).of_joined, -1.0F, 1e-5F);
  EXPECT_NEAR(seen.of_piece_with(9).of_joined, 2.0F, 1e-5F);
}

TEST(FirstImpression, OfAFrameThatShowsNothingIsEmpty) {
  const PeaksOfAFrame frame(kLines, {});
  const Impression seen(frame, {});
  EXPECT_EQ(seen.stripe().coverage, 0.0F);
  EXPECT_LT(seen.stripe().runner_up, 1e-6F);
}

}  // namespace
}  // namespace striper::detail
