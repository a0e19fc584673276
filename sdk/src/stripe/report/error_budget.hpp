// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <striper/stripe/extractor.hpp>
#include <striper/stripe/stripe.hpp>

#include "stripe/edges/reflectance_edge.hpp"
#include "stripe/learn/excess_scatter.hpp"
#include "stripe/learn/texture_scatter.hpp"
#include "stripe/profile/frame_at_hand.hpp"
#include "stripe/select/stripe_choice.hpp"

namespace striper::detail {

/// Adds to the noise of each return what else moves it: steps of reflectance, which it corrects,
/// the excess scatter of the laser's stripe, texture, and what such evidence was found to scatter.
class ErrorBudget {
 public:
  /// What is known of the stripe's width.
  struct Width {
    const WidthModel& model;
    bool is_known;  ///< Told, not learnt.
  };

  void add(const FrameAtHand& at_hand, const Width& width, const StripeChoice& choice,
           const ExtractOptions& options, Stripe& stripe);

  /// What every return of this frame's laser scatters beyond its noise, given or learnt until now.
  double excess_sigma_px(const FrameAtHand& at_hand, const ExtractOptions& options);

  /// What edges did to the last frame's returns.
  const ReflectanceEdges& edges() const noexcept { return edges_; }

 private:
  ExcessScatter& excess_of(int laser);

  ReflectanceEdges edges_;
  TextureScatter texture_;
  std::vector<ExcessScatter> excess_;  // One per laser.
};

}  // namespace striper::detail
