// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper::detail {

/// Estimates the white noise of a frame (lit minus dark), DN rms, from the median absolute
/// difference of neighbouring pixels along the search axis: the stripe and edges are few and do not
/// move a median. About 4000 samples, so 2 %. Quantisation is part of it; never below sqrt(1/12).
/// @param scratch reused between calls: no allocation after the first.
double estimate_frame_noise(const LitFrame& frame, StripeAxis axis,
                            std::vector<std::int32_t>& scratch);

}  // namespace striper::detail
