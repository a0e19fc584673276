// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <opencv2/core/mat.hpp>

namespace striper {

/// Where a laser's stripe can be in the image, and how wide it is there, before a frame is seen:
/// what the model, limits of range and the caller know. Full-sensor pixels.
///
/// `Scanner` fills it in from its model; see pipeline/expect_stripe.hpp.
struct ExpectedStripe {
  /// Of each column (StripeAxis::kColumns) or row (kRows) of the sensor: the first and the last
  /// pixel across between which the stripe can be. Both empty: anywhere. First above last: nowhere.
  /// What lies outside is not searched.
  std::vector<float> first_px, last_px;

  /// Where it is not looked for all the same: CV_8UC1 of the full sensor, non-zero there; may be
  /// empty. Shared, not copied.
  cv::Mat ignored;

  /// The profile's Gaussian sigma, and how it changes with the position across: `sigma_px` at
  /// `pivot_px`. Empty: not known. The extractor begins with it and follows what it sees.
  std::optional<double> sigma_px;
  double sigma_slope = 0.0;  ///< Pixels per pixel.
  double pivot_px = 0.0;

  /// How high it is on white paper that faces the laser squarely, of each pixel across, in the
  /// DN of the calibration's images: exposures may differ by a factor. 0: not known. May be empty.
  std::vector<float> amplitude_dn;
};

}  // namespace striper
