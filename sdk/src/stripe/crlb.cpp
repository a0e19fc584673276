// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Dense>

#include <striper/core/statistics.hpp>
#include <striper/stripe/crlb.hpp>

#include "core/pixel_box.hpp"

namespace striper {
namespace {

double bell(double t) { return std::exp(-0.5 * t * t); }

// The two ends of a pixel, in sigmas from the stripe's centre.
struct PixelEnds {
  double low;
  double high;
};

PixelEnds ends_of(const StripeProfile& p, int i) {
  return {(i - 0.5 - p.position_px) / p.sigma_px, (i + 0.5 - p.position_px) / p.sigma_px};
}

double stripe_value(const StripeProfile& p, int i) {
  const PixelEnds e = ends_of(p, i);
  return std::sqrt(2.0 * std::numbers::pi) * p.sigma_px *
         (normal_below(e.high) - normal_below(e.low));
}

double width_derivative(const StripeProfile& p, int i) {
  const PixelEnds e = ends_of(p, i);
  const double change = e.low * bell(e.low) - e.high * bell(e.high);
  return p.amplitude_dn * (stripe_value(p, i) / p.sigma_px + change);
}

}  // namespace

double StripeProfile::value_dn(int i) const noexcept {
  return background_dn + slope_dn_per_px * i + amplitude_dn * stripe_value(*this, i);
}

double StripeProfile::derivative(int i) const noexcept {
  const PixelEnds e = ends_of(*this, i);
  return amplitude_dn * (bell(e.low) - bell(e.high));
}

double crlb_sigma_px(const StripeProfile& profile, const CrlbOptions& options) {
  // Position last, so that the last pivot is what is left of its information. A parameter that is
  // known has a unit of information of its own and touches nothing.
  enum { kAmplitude, kBackground, kWidth, kSlope, kPosition, kCount };
  using Gradient = Eigen::Matrix<double, kCount, 1>;
  using Information = Eigen::Matrix<double, kCount, kCount>;
  Information information = Information::Zero();
  for (int i = options.first_pixel; i <= options.last_pixel; ++i) {
    const double value = profile.value_dn(i);
    if (options.full_scale_dn > 0.0 && value >= options.full_scale_dn) continue;
    Gradient g;
    g[kAmplitude] = stripe_value(profile, i);
    g[kBackground] = 1.0;
    g[kWidth] = options.width_is_known ? 0.0 : width_derivative(profile, i);
    g[kSlope] = options.slope_is_known ? 0.0 : i - profile.position_px;
    g[kPosition] = profile.derivative(i);
    const double speckle = options.speckle_contrast * profile.amplitude_dn * g[kAmplitude];
    const double variance = options.noise.variance_dn2(value) + speckle * speckle;
    information += g * g.transpose() / variance;
  }
  if (options.width_is_known) information(kWidth, kWidth) = 1.0;
  if (options.slope_is_known) information(kSlope, kSlope) = 1.0;
  // Scaled to a unit diagonal, so that the condition tells what the units do not.
  if (!(information.diagonal().minCoeff() > 0.0)) return std::numeric_limits<double>::infinity();
  const Gradient scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Information> factors(scale.asDiagonal() * information * scale.asDiagonal());
  Gradient unit = Gradient::Zero();
  unit[kPosition] = scale[kPosition];
  const double variance = scale[kPosition] * factors.solve(unit)[kPosition];
  const bool is_determined = factors.isPositive() && variance > 0.0 && factors.rcond() > 1e-12;
  return is_determined ? std::sqrt(variance) : std::numeric_limits<double>::infinity();
}

double white_noise_bound_px(double sigma_px, double snr) {
  return std::sqrt(2.0 / std::sqrt(std::numbers::pi)) *
         std::pow(detail::with_pixel_box(sigma_px), 1.5) / (sigma_px * snr);
}

double shot_noise_bound_px(double sigma_px, double amplitude_dn, double dn_per_electron) {
  const double electrons =
      std::sqrt(2.0 * std::numbers::pi) * sigma_px * amplitude_dn / dn_per_electron;
  return detail::with_pixel_box(sigma_px) / std::sqrt(electrons);
}

}  // namespace striper
