// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/types.hpp>

namespace striper {

/// A band-pass filter: `transmission` inside the band, nothing outside. Without a filter this is
/// the band in which the sensor sees, for example centre 700, width 600, transmission 1.
struct BandPass {
  double center_nm = 900.0;
  double width_nm = 25.0;
  double transmission = 0.8;
};

/// The sensor's noises, each zero or false where it is off.
struct SensorNoise {
  bool shot = true;            ///< Poisson statistics of the electrons.
  double read_noise_e = 20.0;  ///< Gaussian, electrons, before quantisation.
  double prnu = 0.0;     ///< Fixed pattern: relative standard deviation of the pixels' sensitivity.
  double speckle = 0.0;  ///< Contrast of the laser's light from pixel to pixel, new every exposure.
};

/// Light scattered in the lens: this fraction of all light is spread by a Gaussian instead of
/// going to its own pixel. It makes the flare around light sources.
struct Bloom {
  double fraction = 0.0;
  double sigma_px = 8.0;
};

/// Lens, shutter, filter and electronics: what turns radiance into numbers. (Where the light goes
/// is the camera model's business.)
struct Imager {
  double pixel_pitch_m = 9.9e-6;
  double f_number = 1.4;
  double lens_transmission = 0.9;
  double falloff_exponent = 0.0;  ///< Light falls with cos(theta)^this; 4 for a simple lens.
  double blur_sigma_px = 0.0;     ///< Lens blur, a Gaussian, sensor pixels.
  double quantum_efficiency = 0.3;
  BandPass filter;
  double shutter_s = 1.0 / 400000.0;

  int bit_depth = 8;  ///< 8 to 16; frames of more than 8 bits are CV_16UC1.
  double dn_per_electron = 0.05;
  double black_level_dn = 8.0;
  double full_well_e = 0.0;  ///< A pixel holds no more electrons; 0: only the converter limits.
  SensorNoise noise;
  Bloom bloom;

  /// Which part of the sensor is read, sensor pixels; empty: all of it.
  cv::Rect region;
  /// Pixels summed before reading, across and down; each divides the region's size.
  cv::Size binning = {1, 1};
};

}  // namespace striper
