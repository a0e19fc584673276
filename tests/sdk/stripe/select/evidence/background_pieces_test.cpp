// SPDX-License-Identifier: Apache-2.0
// Proves that each candidate counts for the background as far as it is probably not the stripe, and
// which pieces are as long as another. Does not prove what the forests make of it.
#include "stripe/select/evidence/background_pieces.hpp"

#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "support/peaks_of_a_frame.hpp"

namespace striper::detail {
namespace {

using testing::Peak;
using testing::PeaksOfAFrame;

constexpr float kCertain = 30.0F;

// A piece of 20 candidates, then three of four, 60 pixels apart.
std::vector<Peak> one_long_three_short() {
  std::vector<Peak> peaks;
  for (int line = 0; line < 20; ++line) {
    peaks.push_back({line, 50.0});
    if (line < 4) {
      for (int n = 1; n <= 3; ++n) peaks.push_back({line, 50.0 + 60.0 * n});
    }
  }
  return peaks;
}

struct Weighed {
  explicit Weighed(float odds_of_long) : frame(40, one_long_three_short()) {
    const StripePieces& pieces = frame.pieces();
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const bool is_long = pieces.candidate(i).across < 60.0F;
      odds.push_back(is_long ? odds_of_long : -kCertain);
      const float height = pieces.candidate(i).line % 2 == 0 ? 2.0F : 4.0F;
      heights.push_back(is_long ? 7.0F : height);
    }
    background.sum_up(pieces, heights, odds);
  }
  std::size_t piece_at(float across) const {
    const StripePieces& pieces = frame.pieces();
    std::size_t i = 0;
    while (std::abs(pieces.candidate(i).across - across) > 0.5F) ++i;
    return static_cast<std::size_t>(pieces.link(i).piece);
  }
  float as_long_as(float across) const {
    return background.as_long_as(frame.pieces(), piece_at(across));
  }

  PeaksOfAFrame frame;
  std::vector<float> odds, heights;
  BackgroundPieces background;
};

TEST(BackgroundPieces, HaveTheHeightOfWhatIsNotTheStripe) {
  const Weighed weighed(kCertain);
  EXPECT_NEAR(weighed.background.height(), 3.0F, 1e-4F);
  EXPECT_NEAR(weighed.background.spread(), 1.0F, 1e-3F);
}

TEST(BackgroundPieces, CountAsFarAsTheyAreNotTheStripe) {
  const Weighed weighed(0.0F);  // Half of the 20 candidates of height 7, and the 12 others.
  EXPECT_NEAR(weighed.background.height(), (10.0F * 7.0F + 12.0F * 3.0F) / 22.0F, 1e-4F);
}

TEST(BackgroundPieces, AsLongAsAShortOneAreAllOthers) {
  const Weighed weighed(kCertain);
  // Eight candidates in 40 scan lines; the stripe is not of the background.
  EXPECT_NEAR(weighed.as_long_as(110.0F), std::log2(1.0F + 8.0F / 40.0F), 0.01F);
  const Weighed without_stripe(-kCertain);
  EXPECT_NEAR(without_stripe.as_long_as(110.0F), std::log2(1.0F + 28.0F / 40.0F), 0.01F);
}

TEST(BackgroundPieces, AsLongAsALongOneIsNone) {
  const Weighed weighed(-kCertain);
  EXPECT_NEAR(weighed.as_long_as(50.0F), 0.0F, 0.01F);
}

TEST(BackgroundPieces, OfAnEmptyFrameAreNone) {
  const PeaksOfAFrame frame(5, {});
  BackgroundPieces background;
  background.sum_up(frame.pieces(), {}, {});
  EXPECT_EQ(background.height(), 0.0F);
  EXPECT_EQ(background.spread(), 0.0F);
}

}  // namespace
}  // namespace striper::detail
