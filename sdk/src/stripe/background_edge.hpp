// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "stripe/profile_plan.hpp"

namespace striper::detail {

/// Where a peak was found that may be no more than an edge of the background.
struct PeakPlace {
  int line = 0;
  int across = 0;      // Pixel of the image.
  double width = 0.0;  // The stripe's effective sigma there.
  double level = 0.0;  // The straight background that was taken off it, DN.
};

/// Whether the pixels right beside a peak contradict a straight background, being plainly brighter
/// on one side or plainly above it on both, and the matched filter finds less than `threshold`
/// sigmas of noise above the brighter side. About an edge, a straight background is too low on the
/// brighter side: what is left there looks like a stripe.
bool is_edge_of_background(const LitFrame& frame, StripeAxis axis, const PlanNoise& noise,
                           const PeakPlace& place, double threshold);

}  // namespace striper::detail
