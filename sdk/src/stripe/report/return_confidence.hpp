// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <striper/stripe/stripe.hpp>

#include "stripe/edges/reflectance_edge.hpp"
#include "stripe/select/evidence/evidence.hpp"
#include "stripe/select/forests/choice_trees.hpp"
#include "stripe/select/stripe_choice.hpp"

namespace striper::detail {

/// How probable each return is right, as it is reported: within half a pixel or three of its
/// sigmas (of the real images among those that were learnt from, within what their references
/// tell). What was chosen tells most of it; that it was measured, corrected beside an edge and
/// given its error, the rest.
///
/// For frames whose returns were chosen over the whole image, one a scan line. 1 us a return. No
/// allocation after the first frame of a size.
class ReturnConfidence {
 public:
  struct Measured {
    const StripeChoice& choice;
    const ReflectanceEdges& edges;  ///< As they corrected this very stripe.
  };

  /// Of a frame of so many scan lines, none of which is rated yet.
  void begin(std::size_t lines);

  /// Rates all its returns.
  void rate(const Measured& measured, const Stripe& stripe);

  /// The probability of a scan line's return; empty where it was not rated.
  std::optional<float> of_line(std::size_t line) const noexcept;

  /// All that is known of the return of a scan line in which something was chosen, of the frame
  /// that was last rated.
  Evidence evidence(const Measured& measured, const Stripe& stripe,
                    std::size_t line) const noexcept;

 private:
  void look_about(const StripeChoice& choice);
  void finish_batch();

  AxisGrid across_;           // Of the frame that is rated.
  std::vector<float> about_;  // Mean log odds of what was chosen about each scan line.
  float coverage_ = 0.0F;
  std::vector<float> probability_;  // Negative: not rated.
  EvidenceBatch batch_;
};

}  // namespace striper::detail
