// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "stripe/edges/edge_profile.hpp"
#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {

/// Widths from the middle of a stripe to where it is gone.
inline constexpr double kStripeReach = 3.0;

/// The pixels of a scan line about a place, out to where the stripe is gone and a few more.
/// @param width effective, with the pixel's box.
EdgeProfile edge_profile_at(const LitFrame& frame, StripeAxis axis, int line, double position,
                            double width);

/// The background at both ends of a profile, DN.
struct EdgeEnds {
  double before = 0.0;
  double after = 0.0;
};
EdgeEnds ends_of(const EdgeProfile& profile);

/// What is known of a stripe and an edge before the profile is fitted.
/// @param width without the pixel's box.
EdgePrior edge_prior(const LitFrame& frame, const PlanNoise& noise, const EdgeProfile& profile,
                     double position, double amplitude, double width);

}  // namespace striper::detail
