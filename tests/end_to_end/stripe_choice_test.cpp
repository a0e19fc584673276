// SPDX-License-Identifier: Apache-2.0
// Proves that `ok` means the stripe and that a confidence is a probability, against exact truth in
// random rooms and calibration sessions that nothing was tuned on (seeds from 10000), with the
// model that a calibration gives, one laser always on, no dark exposure: wrong `ok`, found stripes,
// phantoms with the laser off, reliability. Does not prove it for scenes of another kind than
// support/random_scene.hpp has, nor for stripes with a signal-to-noise ratio below 8.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "support/choice_trial.hpp"
#include "support/shared_data.hpp"

namespace striper {
namespace {

using testing::ChoiceTrial;
using testing::StripeScore;

// As many scenes as decide the goals take half an hour; the quick tests look at some of them.
#ifdef STRIPER_FULL_TRIALS
constexpr int kRooms = 300;
constexpr int kSessions = 30;
constexpr int kFrames = 0;  // As many as there are.
#else
constexpr int kRooms = 4;
constexpr int kSessions = 2;
constexpr int kFrames = 2;
#endif
constexpr std::uint64_t kHeldOut = 10000;

StripeScore sum_of(ChoiceTrial trial, int count) {
  StripeScore sum;
  trial.frames = kFrames;
  for (int i = 0; i < count; ++i) {
    trial.seed = kHeldOut + static_cast<std::uint64_t>(i);
    sum.add(run_trial(trial).all);
  }
  return sum;
}

std::string text(const StripeScore& score) {
  std::string lines = fmt::format(
      "{} columns: found {:.2f} % of those with SNR 8, wrong {:.3f} %, phantom {:.3f} %, mixed "
      "{:.3f} %, Brier {:.5f}\n",
      score.columns, score.found_percent(), score.wrong_percent(), score.phantom_percent(),
      StripeScore::percent(score.mixed, score.columns), score.brier());
  for (std::size_t i = 0; i < score.bins.size(); ++i) {
    const auto& bin = score.bins[i];
    lines +=
        fmt::format("  confidence from {:.3f}: {} returns, {:.2f} % are the stripe\n",
                    StripeScore::kBins[i], bin.count, StripeScore::percent(bin.stripe, bin.count));
  }
  return lines;
}

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

TEST(StripeChoice, OkIsTheStripeInRoomsAndConfidenceIsAProbability) {
  const StripeScore score = sum_of({.kind = "rooms"}, kRooms);
  std::cout << text(score);
  EXPECT_LE(score.wrong_percent(), 0.1);
  EXPECT_GE(score.found_percent(), 95.0);
  expect_reliable(score);
}

TEST(StripeChoice, ContinuousIsNeverWorseThanBrightest) {
  const StripeScore brightest = sum_of({.kind = "rooms"}, kRooms);
  const StripeScore continuous = sum_of({.kind = "rooms", .peak = PeakRule::kContinuous}, kRooms);
  EXPECT_LE(continuous.wrong, brightest.wrong);
  EXPECT_GE(continuous.found, brightest.found);
}

TEST(StripeChoice, NothingIsOkWhereTheLaserIsOffAndNoStripeIsSaid) {
  const StripeScore score = sum_of({.kind = "off"}, kRooms);
  std::cout << text(score);
  EXPECT_LE(score.phantom_percent(), 0.05);
  EXPECT_EQ(score.unseen, score.scans);
}

TEST(StripeChoice, OkIsTheStripeInTheSessionOfTheScenes) {
  ChoiceTrial trial{.kind = testing::source_path("data/scenes/calibration.yaml").string()};
  trial.seed = 1991;
  trial.frames = 10;
  const StripeScore score = run_trial(trial).all;
  std::cout << text(score);
  EXPECT_GE(StripeScore::percent(score.found_visible, score.visible), 97.0);
  EXPECT_LE(score.wrong_percent(), 0.5);
}

TEST(StripeChoice, OkIsTheStripeInSessionsOfOtherBoardsLensesAndWidths) {
  const StripeScore score = sum_of({.kind = "sessions"}, kSessions);
  std::cout << text(score);
  EXPECT_GE(score.found_percent(), 97.0);
  EXPECT_LE(score.wrong_percent(), 0.5);
}

TEST(StripeChoice, OkIsTheStripeInSessionsOfColourCameras) {
  for (const char* colour : {"red", "green"}) {
    const StripeScore score = sum_of({.kind = "sessions", .colour = colour}, kSessions);
    std::cout << colour << ": " << text(score);
    EXPECT_GE(score.found_percent(), 97.0) << colour;
    EXPECT_LE(score.wrong_percent(), 0.5) << colour;
  }
}

}  // namespace
}  // namespace striper
