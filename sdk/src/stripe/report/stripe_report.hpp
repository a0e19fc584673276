// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/stripe/extractor.hpp>
#include <striper/stripe/stripe.hpp>

#include "stripe/candidates/candidate_finder.hpp"
#include "stripe/profile/frame_at_hand.hpp"
#include "stripe/select/stripe_choice.hpp"
#include "stripe/track/line_follower.hpp"

namespace striper::detail {

/// Says of every scan line what was chosen there, and with what status.
class StripeReport {
 public:
  struct Choice {
    const FrameAtHand& at_hand;
    const ExtractOptions& options;
    CandidateFinder& finder;  ///< Its peaks are judged.
    const StripeChoice& choice;
    const WidthModel& width;
  };

  /// @param stripe has a return for every scan line, and its grid.
  void write(const Choice& chosen, Stripe& stripe);

 private:
  void put_chosen(const Choice& chosen, Stripe& stripe);

  LineFollower follower_;
};

}  // namespace striper::detail
