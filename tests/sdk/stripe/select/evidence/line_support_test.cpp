// SPDX-License-Identifier: Apache-2.0
// Proves that a stripe of which a texture leaves dashes alone has more support than the texture's
// own peaks, in images of any size, and what is counted at their borders. Does not prove what the
// forests make of it.
#include "stripe/select/evidence/line_support.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "support/allocation_counter.hpp"
#include "support/peaks_of_a_frame.hpp"
#include "support/random.hpp"

namespace striper::detail {
namespace {

using testing::Peak;
using testing::PeaksOfAFrame;

constexpr float kEven = 0.0F;  // Log odds of one in two.

double on_stripe(int line) { return 120.3 + 0.35 * line; }

// Three of four scan lines in dashes of six show the stripe, each three peaks of the texture.
std::vector<Peak> dashed_stripe(int lines) {
  testing::reseed();
  std::vector<Peak> peaks;
  for (int line = 0; line < lines; ++line) {
    if (line % 8 < 6) peaks.push_back({line, on_stripe(line)});
    for (int k = 0; k < 3; ++k) peaks.push_back({line, testing::uniform(0.0, 480.0)});
  }
  return peaks;
}

TEST(LineSupport, DashesOfAStripeHaveMoreThanATexture) {
  for (const int lines : {400, 640, 1280, 4096}) {
    const PeaksOfAFrame frame(lines, dashed_stripe(lines));
    const StripePieces& pieces = frame.pieces();
    LineSupport support;
    support.find(pieces, std::vector<float>(pieces.size(), kEven), -5.0F);
    float least = 1e9F;
    float most = 0.0F;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const Candidate& c = pieces.candidate(i);
      const double off = std::abs(static_cast<double>(c.across) - on_stripe(c.line));
      if (off < 0.01) least = std::min(least, support.of(i).far);
      if (off > 20.0) most = std::max(most, support.of(i).far);
    }
    EXPECT_GT(least, 1.5F * most) << lines;
    EXPECT_GT(least, 0.5F * 0.7F) << lines;
  }
}

TEST(LineSupport, WhatIsHopelessHasNoneAndGivesNone) {
  const PeaksOfAFrame frame(100, {{49, 50.0}, {50, 50.0}, {51, 50.0}});
  const StripePieces& pieces = frame.pieces();
  ASSERT_EQ(pieces.size(), 3U);
  LineSupport support;
  support.find(pieces, {kEven, kEven, -6.0F}, -5.0F);
  EXPECT_NEAR(support.of(0).far, 0.5F / 20.0F, 1e-6F);  // Ten scan lines to each side.
  EXPECT_NEAR(support.of(0).near, 0.5F / 8.0F, 1e-6F);
  EXPECT_NEAR(support.of(0).hits, 1.0F / 20.0F, 1e-6F);
  EXPECT_EQ(support.of(2).far, 0.0F);
}

TEST(LineSupport, CountsTheScanLinesThatThereAre) {
  const PeaksOfAFrame frame(100, {{0, 50.0}, {1, 50.0}, {99, 50.0}});
  LineSupport support;
  support.find(frame.pieces(), std::vector<float>(3, kEven), -5.0F);
  EXPECT_NEAR(support.of(0).far, 0.5F / 10.0F, 1e-6F);
  EXPECT_NEAR(support.of(1).far, 0.5F / 11.0F, 1e-6F);
  EXPECT_EQ(support.of(2).far, 0.0F);
}

TEST(LineSupport, OfAScanLineTheBestEightVote) {
  std::vector<Peak> peaks;
  for (int k = 0; k < 20; ++k) peaks.push_back({50, 20.0 * k});
  peaks.push_back({51, 380.0});
  const PeaksOfAFrame frame(100, peaks);
  std::vector<float> odds(21, kEven);
  for (std::size_t k = 0; k < 20; ++k) odds[k] = 0.1F * static_cast<float>(k);
  LineSupport support;
  support.find(frame.pieces(), odds, -5.0F);
  EXPECT_EQ(support.of(11).far, 0.0F);
  EXPECT_GT(support.of(19).far, 0.0F);  // That of scan line 51 goes on from it.
  EXPECT_GT(support.of(20).far, 0.04F);
}

TEST(LineSupport, AllocatesNothingOnceItHasRoom) {
  const PeaksOfAFrame frame(640, dashed_stripe(640));
  const std::vector<float> odds(frame.pieces().size(), kEven);
  LineSupport support;
  support.reserve(frame.pieces().most(), frame.pieces().lines());
  const testing::AllocationCounter counter;
  support.find(frame.pieces(), odds, -5.0F);
  EXPECT_EQ(counter.count(), 0U);
}

}  // namespace
}  // namespace striper::detail
