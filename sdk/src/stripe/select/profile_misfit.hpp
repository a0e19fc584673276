// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "stripe/select/stripe_pieces.hpp"

namespace striper::detail {

/// How far a candidate's pixels are from the Gaussian on a straight background that was fitted.
struct ProfileMisfit {
  float residual = 0.0F;  ///< Root mean square, in heights; 0 where it is clipped.
  float sides = 1.0F;     ///< Rise above the brighter side over that above the darker one.
};

/// Looks at 2.5 widths on either side, 3 to 24 pixels. 50 ns; no allocation.
ProfileMisfit misfit_of(const LitFrame& frame, StripeAxis axis, const Candidate& candidate);

}  // namespace striper::detail
