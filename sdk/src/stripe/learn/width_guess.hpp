// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "stripe/candidates/block_maxima.hpp"

namespace striper::detail {

/// A first guess of the stripe's effective sigma, pixels of the image: from the width at half
/// height of the mean profile of the scan lines whose peak is clear. Empty where there are none.
std::optional<double> guess_stripe_width(const LitFrame& frame, StripeAxis axis,
                                         const BlockMaxima& blocks, double noise_dn);

}  // namespace striper::detail
