// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "stripe/learn/width_tracker.hpp"
#include "stripe/select/stripe_choice.hpp"

namespace striper::detail {

/// Takes samples of the stripe's width from the peaks that were chosen as the stripe, not judged
/// yet: of scan lines spread over the frame, fewer once the width is known; where nearly all of
/// them are clipped, from the flanks of a few.
class WidthLearner {
 public:
  /// Returns by what factor the width has changed.
  double learn(const LitFrame& frame, StripeAxis axis, const StripeChoice& choice,
               WidthTracker& width);

 private:
  int add_clipped_samples(const LitFrame& frame, StripeAxis axis, const StripeChoice& choice,
                          WidthTracker& width);

  std::size_t next_line_ = 0;  // Frames look at different scan lines.
  int next_clipped_line_ = 0;
};

}  // namespace striper::detail
