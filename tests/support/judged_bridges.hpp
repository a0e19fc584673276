// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "stripe/track/bridged_gaps.hpp"
#include "support/extracted_trial.hpp"
#include "support/stripe_score.hpp"

namespace striper::testing {

// Whether neither a scan line nor one beside it has a stripe.
inline bool is_unlit(const Truth& truth, int line) {
  const auto is_visible = [&](int number) {
    return number >= 0 && number < static_cast<int>(truth.lines.size()) &&
           truth.lines[static_cast<std::size_t>(number)].status == TruthStatus::kVisible;
  };
  return !is_visible(line - 1) && !is_visible(line) && !is_visible(line + 1);
}

// Calls `visit` with each of a frame's bridges, taken or not, and whether it is where the stripe
// is; what lies between the two stripes of an edge is neither, unless neither its scan line nor one
// beside it has a stripe.
template <typename Visit>
void for_each_judged_bridge(const Extracted& extracted, const Visit& visit) {
  for (const detail::BridgedGaps::Bridge& bridge : extracted.extractor.bridges().bridges()) {
    const Judgement judged =
        judge_position(extracted.truth, bridge.line, bridge.across_px, bridge.sigma_px).judgement;
    if (judged != Judgement::kMixed || is_unlit(extracted.truth, bridge.line))
      visit(bridge, judged == Judgement::kRight);
  }
}

}  // namespace striper::testing
