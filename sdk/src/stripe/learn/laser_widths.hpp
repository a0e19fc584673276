// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <striper/stripe/extractor.hpp>

#include "stripe/candidates/block_maxima.hpp"
#include "stripe/learn/width_learner.hpp"
#include "stripe/learn/width_tracker.hpp"
#include "stripe/profile/frame_at_hand.hpp"
#include "stripe/select/stripe_choice.hpp"

namespace striper::detail {

/// How wide each laser's stripe is: told, or learnt from frame to frame.
class LaserWidths {
 public:
  /// The width of a laser's stripe; where nothing is known of it yet, as it was told or as the
  /// brightest pixels show it.
  WidthTracker& of(const FrameAtHand& at_hand, const BlockMaxima& blocks,
                   const ExtractOptions& options);

  /// Takes in what was chosen. Returns by what factor the width has changed.
  double learn(const FrameAtHand& at_hand, const StripeChoice& choice, WidthTracker& width) {
    return learner_.learn(at_hand.frame, at_hand.axis, choice, width);
  }

 private:
  WidthLearner learner_;
  std::vector<WidthTracker> widths_;  // One per laser.
};

/// The caller's, or the model's: in pixels of the image.
std::optional<WidthModel> known_width(const LitFrame& frame, const ExtractOptions& options);

/// What the model says of a laser's stripe; null: nothing.
const ExpectedStripe* expected_of(const ExtractOptions& options, int laser);

}  // namespace striper::detail
