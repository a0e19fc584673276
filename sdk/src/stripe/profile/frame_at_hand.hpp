// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "stripe/profile/ignored_pixels.hpp"
#include "stripe/profile/profile_kernel.hpp"
#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {

/// The frame that is searched, and its noise.
struct FrameAtHand {
  const LitFrame& frame;
  StripeAxis axis;
  ProfileImages images;
  PlanNoise noise;
  double noise_dn;  ///< Of a dark pixel.
  double step;      ///< Sensor pixels per image pixel across.
  IgnoredPixels ignored{};
};

/// The pixels of a frame, as the kernel reads them.
ProfileImages images_of(const LitFrame& frame, StripeAxis axis);

/// Whether the background was subtracted: an exposure without the laser.
inline bool is_background_subtracted(const LitFrame& frame) noexcept {
  return !frame.dark.empty() && !frame.is_dark_a_channel;
}

}  // namespace striper::detail
