// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

namespace striper {

/// What a laser's stripe looks like in the image, as the calibration saw it on its boards; the
/// model file's `stripe.lasers`. All of it is optional: what is not known is left empty, and the
/// extractor then learns it from the frames.
struct StripeLook {
  struct WidthAt {
    double range_m = 0.0;
    double width_px = 0.0;
  };
  struct AmplitudeAt {
    double range_m = 0.0;
    double amplitude_dn = 0.0;
  };

  /// The profile's Gaussian sigma, sensor pixels, as the CSV's `width_px`.
  std::optional<double> width_px;

  /// Its course over the depth that was calibrated, ranges rising; empty or at least two.
  std::vector<WidthAt> width_at;

  /// Amplitude above the background on white paper that faces the laser squarely (the measured one
  /// over the cosine of incidence), DN of the calibration's images, in rising order of range;
  /// empty or at least two. It may begin farther than `width_at`: a stripe that clipped tells none.
  std::vector<AmplitudeAt> amplitude_at;

  /// Shares of blue, green and red in the stripe's own light as the camera sees it; sum 1.
  std::optional<std::array<double, 3>> colour;
};

}  // namespace striper
