// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "stripe/track/bridged_gaps.hpp"
#include "support/extracted_trial.hpp"
#include "support/stripe_score.hpp"

namespace striper::testing {

// Calls `visit` with each of a frame's bridges, taken or not, and whether it is where the stripe
// is; what lies between the two stripes of an edge is neither.
template <typename Visit>
void for_each_judged_bridge(const Extracted& extracted, const Visit& visit) {
  for (const detail::BridgedGaps::Bridge& bridge : extracted.extractor.bridges().bridges()) {
    const Judgement judged =
        judge_position(extracted.truth, bridge.line, bridge.across_px, bridge.sigma_px).judgement;
    if (judged != Judgement::kMixed) visit(bridge, judged == Judgement::kRight);
  }
}

}  // namespace striper::testing
