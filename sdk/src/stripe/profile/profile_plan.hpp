// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>

#include <striper/core/noise_model.hpp>

#include "stripe/profile/profile_kernel.hpp"

namespace striper::detail {

/// The stripe's effective Gaussian sigma (pixel box included: sigma_e^2 = sigma^2 + 1/12) as a
/// function of the position across, pixels of the image.
struct WidthModel {
  double at_pivot = 0.0;
  double slope = 0.0;  // Per pixel.
  double pivot = 0.0;
  double amplitude_dn = 0.0;  // Of the stripe where it is clear; 0: not known yet.

  double at(double across) const noexcept { return at_pivot + slope * (across - pivot); }
};

/// What is known of the noise of lit - dark.
struct PlanNoise {
  NoiseModel model;                               // Of one exposure.
  double dark_noise_gain = 0.0;                   // Of the dark image, in parts of an exposure's.
  std::array<float, 3> dark_noise_correlation{};  // Along the scan line, one to three pixels apart.
  double speckle_contrast = 0.0;
};

/// The width that a plan is made for: the stripe's, within what the windows hold.
double typical_width(const WidthModel& width);

/// The noise of the dark image as a filter sees it, in parts of an exposure's: what neighbours have
/// in common does not average out. @param half_taps from the middle of a symmetric filter outwards.
double dark_gain_through(const PlanNoise& noise, std::span<const float> half_taps);

/// The sigma of the matched filter: the stripe's, and where nothing comes after the filter more in
/// the light's own noise, which the flanks have less of.
double filter_sigma(const WidthModel& width, const PlanNoise& noise, bool refine);

/// How far from a peak the pixels lie that its background is estimated from.
enum class BackgroundReach {
  kNarrow,  ///< Right beside the stripe: between surfaces whose edges are near.
  kUsual,   ///< A window of at least 14 widths, where a slope as a nuisance costs at most 1.6 %.
  kWide,    ///< For weak peaks, whose significance the background's own error would limit.
};

/// Lays out the windows for a stripe of this width.
ProfilePlan plan_profile(const WidthModel& width, const PlanNoise& noise, bool refine,
                         BackgroundReach reach);

}  // namespace striper::detail
