// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include <striper/core/return_status.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper {

/// One return: where the stripe is in the image and, through the model, where the surface is in
/// the scan frame (CONVENTIONS.md). A number that does not exist is NaN and `status` says why,
/// never 0.
struct Return {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  double u_px =
      kNone;  ///< Full-sensor pixel; the scan line's own coordinate is exact even without a stripe.
  double v_px = kNone;

  double bearing_rad = kNone;  ///< Counter-clockwise from the scan frame's x about its z.
  double range_m = kNone;      ///< From the scan frame's origin.
  double range_near_m =
      kNone;  ///< The smaller range at the position minus and plus half an image pixel,
  double range_far_m =
      kNone;               ///< and the larger one; inf where that ray no longer meets the plane.
  double sigma_m = kNone;  ///< One-sigma random error of this return.
  double sigma_cal_m = kNone;  ///< One-sigma calibration error here; common to all columns: never
                               ///< average it down. NaN where the model has no covariance.
  double x_m = kNone;          ///< range * cos(bearing).
  double y_m = kNone;          ///< range * sin(bearing).

  float intensity_dn =
      static_cast<float>(kNone);               ///< Amplitude above the background, DN of the input.
  float width_px = static_cast<float>(kNone);  ///< The stripe's Gaussian sigma, sensor pixels.
  float row_sigma_px =
      static_cast<float>(kNone);  ///< One-sigma random error across the stripe, sensor pixels.
  float confidence = static_cast<float>(kNone);  ///< 0 to 1.

  ReturnStatus status = ReturnStatus::kNoStripe;

  /// The pixel along the stripe, which says the scan line.
  double along_px(StripeAxis axis) const noexcept {
    return axis == StripeAxis::kColumns ? u_px : v_px;
  }

  /// The pixel across the stripe, which says the range.
  double across_px(StripeAxis axis) const noexcept {
    return axis == StripeAxis::kColumns ? v_px : u_px;
  }
};

}  // namespace striper
