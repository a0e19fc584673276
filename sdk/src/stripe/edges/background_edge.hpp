// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {

/// Where a peak was found that may be no more than an edge of the background.
struct PeakPlace {
  int line = 0;
  int across = 0;      // Pixel of the image.
  double width = 0.0;  // The stripe's effective sigma, of the frame.
  double level = 0.0;  // The straight background that was subtracted from it, DN, to a few pixels.
};

/// What the matched filter finds of a peak above the brighter one of its sides, 0 or more, in
/// sigmas of noise, where the pixels right beside it contradict a straight background: brighter on
/// one side than noise makes them, or above it on both; at the image's border, off it on the only
/// side. Infinite where they do not. About an edge, a straight background is too low on the
/// brighter side: what is left there looks like a stripe, but does not rise above that side.
double significance_above_edge(const LitFrame& frame, StripeAxis axis, const PlanNoise& noise,
                               const PeakPlace& place);

/// How far off another stripe, of that width, still brightens what is taken for the background.
double disturbed_by_neighbours_px(double width);

}  // namespace striper::detail
