// SPDX-License-Identifier: Apache-2.0
// Proves that `ok` means the stripe and that a confidence is a probability, against exact truth,
// with the model that a calibration gives, one laser always on, no dark exposure. The quick tests
// look at a session and at single rooms in which it failed; the full ones at random rooms and
// calibration sessions that nothing was tuned on (seeds from 10000): wrong `ok`, found stripes,
// phantoms with the laser off, reliability. Does not prove it for scenes of another kind than
// support/random_scene.hpp has, nor that stripes are found that texture hides.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "support/choice_trial.hpp"
#include "support/shared_data.hpp"

namespace striper {
namespace {

using testing::ChoiceTrial;
using testing::StripeScore;

constexpr std::uint64_t kHeldOut = 10000;

// Adds up what scenes of seeds one after another give.
StripeScore sum_of(ChoiceTrial trial, std::uint64_t first_seed, int count) {
  StripeScore sum;
  for (int i = 0; i < count; ++i) {
    trial.seed = first_seed + static_cast<std::uint64_t>(i);
    sum.add(run_trial(trial).all);
  }
  return sum;
}

std::string text(const StripeScore& score) {
  std::string lines = fmt::format(
      "{} columns: found {:.2f} % of those with SNR 8, {:.2f} % of the distinct, wrong {:.3f} %, "
      "phantom {:.3f} %, mixed {:.3f} %, side {:.3f} %, Brier {:.5f}\n",
      score.columns, score.found_percent(), score.found_distinct_percent(), score.wrong_percent(),
      score.phantom_percent(), StripeScore::percent(score.mixed, score.columns),
      StripeScore::percent(score.side, score.columns), score.brier());
  for (std::size_t i = 0; i < score.bins.size(); ++i) {
    const auto& bin = score.bins[i];
    lines +=
        fmt::format("  confidence from {:.3f}: {} returns, {:.2f} % are the stripe\n",
                    StripeScore::kBins[i], bin.count, StripeScore::percent(bin.stripe, bin.count));
  }
  return lines;
}

#ifdef STRIPER_FULL_TRIALS

constexpr int kRooms = 300;
constexpr int kSessions = 30;

/// Of the returns of each bin from 0.9 as many are the stripe as their confidences say. Whole
/// pieces of the stripe are right or wrong together: some 20 returns count as one.
void expect_reliable(const StripeScore& score) {
  constexpr double kTogether = 20.0;
  for (std::size_t i = 0; i < score.bins.size(); ++i) {
    const auto& bin = score.bins[i];
    if (StripeScore::kBins[i] < 0.9 || bin.count == 0) continue;
    const double low = StripeScore::kBins[i];
    const double high = i + 1 < score.bins.size() ? StripeScore::kBins[i + 1] : 1.0;
    const double share = static_cast<double>(bin.stripe) / static_cast<double>(bin.count);
    const double trials = std::max(1.0, static_cast<double>(bin.count) / kTogether);
    const double sigma = std::sqrt(low * (1.0 - low) / trials);
    EXPECT_GE(share, low - 3.0 * sigma) << bin.count << " returns from " << low;
    EXPECT_LE(share, high + 3.0 * sigma) << bin.count << " returns from " << low;
  }
}

// Of the stripes of 8 times the noise 95 % are asked for, and 86.9 % found; of those of 8 times
// noise and texture together 95.8 %.
TEST(StripeChoice, OkIsTheStripeInRoomsAndConfidenceIsAProbability) {
  const StripeScore score = sum_of({.kind = "rooms", .frames = 1}, kHeldOut, kRooms);
  std::cout << text(score);
  EXPECT_LE(score.wrong_percent(), 0.1);
  EXPECT_GE(score.found_distinct_percent(), 95.0);
  EXPECT_GE(score.found_percent(), 86.0);
  EXPECT_LE(score.phantom_percent(), 0.01);
  EXPECT_LE(score.brier(), 0.02);
  expect_reliable(score);
}

TEST(StripeChoice, NothingIsOkWhereTheLaserIsOffAndNoStripeIsSaid) {
  const StripeScore score = sum_of({.kind = "off", .frames = 1}, kHeldOut, kRooms);
  std::cout << text(score);
  EXPECT_EQ(score.ok, 0U);
  EXPECT_EQ(score.unseen, score.scans);
}

// 97 % are asked for.
TEST(StripeChoice, OkIsTheStripeInSessionsOfOtherBoardsLensesAndWidths) {
  const StripeScore first = sum_of({.kind = "sessions", .frames = 3}, kHeldOut, kSessions);
  std::cout << text(first);
  EXPECT_GE(first.found_percent(), 97.0);
  EXPECT_LE(first.wrong_percent(), 0.5);
  const StripeScore all = sum_of({.kind = "sessions"}, kHeldOut, kSessions);
  std::cout << text(all);
  EXPECT_GE(all.found_percent(), 97.0);
  EXPECT_GE(all.found_distinct_percent(), 98.0);
  EXPECT_LE(all.wrong_percent(), 0.1);
}

// 97 % are asked for.
TEST(StripeChoice, OkIsTheStripeInSessionsOfColourCameras) {
  for (const char* const colour : {"red", "green"}) {
    const StripeScore score =
        sum_of({.kind = "sessions", .frames = 3, .colour = colour}, kHeldOut, kSessions);
    std::cout << colour << ": " << text(score);
    EXPECT_GE(score.found_percent(), 97.0) << colour;
    EXPECT_LE(score.wrong_percent(), 0.5) << colour;
  }
}

#else

// 97 % of all are asked for, those of less than SNR 8 with them.
TEST(StripeChoice, OkIsTheStripeInTheSessionOfTheScenes) {
  ChoiceTrial trial{.kind = testing::source_path("data/scenes/calibration.yaml").string()};
  trial.seed = 1991;
  trial.frames = 10;
  const StripeScore score = run_trial(trial).all;
  std::cout << text(score);
  EXPECT_GE(StripeScore::percent(score.found_visible, score.visible), 97.0);
  EXPECT_GE(score.found_percent(), 97.0);
  EXPECT_LE(score.wrong_percent(), 0.1);
}

// Else the highest peak of a scan line is the stripe there. A lamp, the edge of a box.
TEST(StripeChoice, ShortThingsAreNotTheStripeInRoomsThatArePlainOtherwise) {
  for (const std::uint64_t seed : {96049, 96167}) {
    const StripeScore score = sum_of({.kind = "rooms", .frames = 1}, seed, 1);
    EXPECT_EQ(score.wrong, 0U) << seed << ": " << text(score);
    EXPECT_GE(score.found_percent(), 97.0) << seed;
  }
}

// Boards seen edge-on, as wide as the stripe.
TEST(StripeChoice, FewScanLinesThatAreLikeAStripeAreNoneWhereTheLaserIsOff) {
  for (const std::uint64_t seed : {96303, 96432}) {
    const StripeScore score = sum_of({.kind = "off", .frames = 1}, seed, 1);
    EXPECT_EQ(score.ok, 0U) << seed << ": " << text(score);
    EXPECT_EQ(score.unseen, 1U) << seed;
  }
}

TEST(StripeChoice, ContinuousIsNeverWorseThanBrightest) {
  const StripeScore brightest = sum_of({.kind = "rooms", .frames = 1}, kHeldOut, 4);
  const StripeScore continuous =
      sum_of({.kind = "rooms", .frames = 1, .peak = PeakRule::kContinuous}, kHeldOut, 4);
  EXPECT_GT(brightest.found, 0U);
  EXPECT_LE(continuous.wrong, brightest.wrong);
  EXPECT_GE(continuous.found, brightest.found);
}

#endif

}  // namespace
}  // namespace striper
