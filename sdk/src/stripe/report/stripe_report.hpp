// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/stripe/extractor.hpp>
#include <striper/stripe/stripe.hpp>

#include "stripe/candidates/candidate_finder.hpp"
#include "stripe/profile/frame_at_hand.hpp"
#include "stripe/report/return_confidence.hpp"
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

  /// Whether returns are rated once they were measured, see ReturnConfidence: those that were
  /// chosen over the whole image, one a scan line, whichever is the stripe.
  static bool is_rated(const StripeChoice& choice, const ExtractOptions& options) noexcept;

  /// What is rated later is given the status that the candidates' probability makes of it.
  /// @param stripe has a return for every scan line, and its grid.
  void write(const Choice& chosen, Stripe& stripe);

  /// Says it once more, of returns that were measured and rated since.
  void settle(const Choice& chosen, const ReturnConfidence& confidence, Stripe& stripe) const;

 private:
  void put_chosen(const Choice& chosen, Stripe& stripe);

  LineFollower follower_;
};

}  // namespace striper::detail
