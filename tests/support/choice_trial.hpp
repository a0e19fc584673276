// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <striper/core/channel.hpp>
#include <striper/stripe/extractor.hpp>

#include "support/stripe_score.hpp"

namespace striper::testing {

/// A scanner before a random scene, one laser always on, with the model that a perfect calibration
/// would give.
struct ChoiceTrial {
  std::string kind = "rooms";  ///< `rooms`, `off` (rooms without the laser), `sessions`, or a file.
  std::uint64_t seed = 1;
  int frames = 0;  ///< 0: 3, or as many as a session has.
  PeakRule peak = PeakRule::kBrightest;
  bool knows_stripe = true;  ///< The model says what the stripe looks like.
  /// `grey`; `red` or `green`: a colour camera and such a laser; `mixed`: by the seed.
  std::string colour = "grey";
  std::optional<Channel> channel{};  ///< Instead of the laser's own.
};

struct ChoiceScore {
  StripeScore first;  ///< Of the first frame alone.
  StripeScore all;
};

/// Called with each frame's number and its judged returns.
using JudgedFrame = std::function<void(int frame, const std::vector<JudgedReturn>& returns)>;

/// Runs a trial: 0.3 to 3 s. Thread-safe.
ChoiceScore run_trial(const ChoiceTrial& trial, const JudgedFrame& visit = {});

}  // namespace striper::testing
