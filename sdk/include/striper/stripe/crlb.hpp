// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/core/noise_model.hpp>

namespace striper {

/// A stripe's profile along one scan line: pixel i holds
/// `background + slope * (i - centre) + amplitude * integral over the pixel of exp(-x^2 / 2
/// sigma^2)`, x from `position`. DN and pixels.
struct StripeProfile {
  double position_px = 0.0;
  double amplitude_dn = 0.0;  ///< Of the Gaussian before the pixels integrate it.
  double sigma_px = 1.0;      ///< Likewise.
  double background_dn = 0.0;
  double slope_dn_per_px = 0.0;  ///< Of the background, about pixel 0.

  /// What pixel i holds without noise.
  double value_dn(int i) const noexcept;

  /// d value / d position of pixel i.
  double derivative(int i) const noexcept;
};

/// What is unknown besides the position, and what the pixels suffer.
struct CrlbOptions {
  int first_pixel = 0;  ///< The pixels used, both ends included.
  int last_pixel = 0;
  NoiseModel noise;               ///< Its variance is that of each pixel.
  double speckle_contrast = 0.0;  ///< Adds (contrast * (value - background))^2.
  double full_scale_dn = 0.0;     ///< Pixels at or above are clipped and tell nothing; 0: none.
  bool width_is_known = false;    ///< Whether sigma is given rather than estimated.
  bool slope_is_known = true;     ///< Whether the background's slope is.
};

/// The Cramer-Rao bound: the smallest one-sigma error, in pixels, that any unbiased estimator of
/// the position can have, with amplitude and background (and width, and slope) unknown as well.
/// From the Fisher information of independent normal pixels, F = sum over pixels of the outer
/// product of the value's derivatives over its variance (Kay 1993, Fundamentals of Statistical
/// Signal Processing, 3.9; the variance's own dependence on the parameters adds nothing worth
/// having and is left out). Infinity where the pixels do not determine the position.
double crlb_sigma_px(const StripeProfile& profile, const CrlbOptions& options);

/// The bound in white noise and fine sampling, sqrt(2 / sqrt(pi)) sigma_e^1.5 / (sigma snr), with
/// sigma_e^2 = sigma^2 + 1/12 and snr the amplitude over the noise.
double white_noise_bound_px(double sigma_px, double snr);

/// The bound where only the light's own shot noise counts: sigma_e / sqrt(electrons of the stripe).
double shot_noise_bound_px(double sigma_px, double amplitude_dn, double dn_per_electron);

}  // namespace striper
