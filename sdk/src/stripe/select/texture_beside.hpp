// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper::detail {

/// How far what is beside a profile stands out as a stripe would: root mean square of a pixel
/// over the mean of those two widths before and after it, DN. Noise and texture together: what
/// is no higher than this is one of many.
///
/// At nine places on either side, three quarters of a width apart, that have no pixel of the
/// profile in them (3 widths). 50 ns; no allocation.
/// @param across of the profile's middle, and @param width its effective sigma, pixels.
float texture_beside(const LitFrame& frame, StripeAxis axis, int line, float across, float width);

}  // namespace striper::detail
