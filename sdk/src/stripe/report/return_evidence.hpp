// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <striper/core/pixel_grid.hpp>
#include <striper/stripe/stripe.hpp>

#include "stripe/edges/reflectance_edge.hpp"
#include "stripe/select/evidence/evidence.hpp"
#include "stripe/select/stripe_choice.hpp"

namespace striper::detail {

/// What is known of a frame's returns, one a scan line, once each was chosen, measured, corrected
/// beside edges and given its error.
///
/// No allocation after the first frame of a size.
class ReturnEvidence {
 public:
  struct Measured {
    const StripeChoice& choice;
    const ReflectanceEdges& edges;  ///< As they corrected this very stripe.
  };

  /// Of a frame of so many scan lines, none of which was looked at.
  void begin(std::size_t lines);

  /// Looks at a frame as a whole.
  void look_at(const Measured& measured, const Stripe& stripe);

  /// The scan lines that have a return.
  const std::vector<std::size_t>& returns() const noexcept { return returns_; }

  /// How the return of one of them was measured: kThird and what follows, before kFourth.
  void add_measured(const Measured& measured, const Stripe& stripe, std::size_t line,
                    Evidence& evidence) const noexcept;

  /// That, and all that was known of it as a candidate.
  Evidence of(const Measured& measured, const Stripe& stripe, std::size_t line) const noexcept;

 private:
  void look_about(const StripeChoice& choice);

  AxisGrid across_;
  std::vector<std::size_t> returns_;
  std::vector<float> chosen_;  // Log odds of what was chosen in each scan line.
  float coverage_ = 0.0F;
};

}  // namespace striper::detail
