// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper::detail {

/// Where a stripe with clipped pixels is thought to be.
struct ClippedProfile {
  int line = 0;
  double position = 0.0;   // Image pixels across.
  double amplitude = 0.0;  // DN, of the whole profile, above full scale where it is clipped.
  double width = 0.0;      // Effective sigma, a first guess.
};

/// Fits the effective sigma of a profile to its flanks: Gauss-Newton on position, amplitude, width,
/// background and slope, clipped pixels masked. Slow (3 us a step): for a few profiles of a frame.
/// @return empty where the flanks do not tell.
std::optional<double> fit_clipped_width(const LitFrame& frame, StripeAxis axis,
                                        const ClippedProfile& guess);

}  // namespace striper::detail
