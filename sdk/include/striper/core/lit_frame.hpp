// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include <opencv2/core/mat.hpp>

#include <striper/core/frame.hpp>

namespace striper {

/// Holds one lit exposure, ready for the stripe to be found in `lit - dark`.
///
/// The two images are kept apart so that the search can subtract while it reads (one pass over
/// both) and see which lit pixels are clipped. `dark` is whatever must be subtracted: the ambient
/// light interpolated from dark exposures, or, for a colour difference such as green - red, the
/// other channel.
///
/// The pixels are read-only and shared; a LitFrame is valid as long as its images are.
struct LitFrame {
  cv::Mat lit;   ///< CV_8UC1 or CV_16UC1.
  cv::Mat dark;  ///< Same size and type as `lit`, or empty: nothing to subtract.
  /// Whether `dark` is another colour of the same exposure: what of the background is coloured
  /// stays in `lit - dark`.
  bool is_dark_a_channel = false;
  cv::Mat variance;  ///< CV_32FC1, DN^2: what motion and edges leave in `lit - dark`, beyond
                     ///< noise; may be empty.
  cv::Mat masked;    ///< CV_8UC1: non-zero where a stripe could not be seen; may be empty.
  /// The noise of `dark`, as a fraction of a single exposure's noise variance: 1 for an exposure, a
  /// half for the mean of two.
  float dark_noise_gain = 1.0F;
  /// Correlation of that noise between pixels one, two and three rows apart: not 0 where rows were
  /// interpolated from the same rows. A stripe, rows high, sees it summed up.
  std::array<float, 3> dark_noise_correlation{};
  int full_scale_dn = 0;  ///< A pixel of `lit` at or above this is clipped.
  PixelGrid grid;

  std::uint64_t sequence = 0;
  FrameTime time;
  std::uint64_t exposure_number = 0;  ///< Its place in the illumination pattern, gaps included.
  std::int64_t exposure_ns = 0;       ///< How long the shutter was open; 0 if unknown.
  int laser = 0;                      ///< Index of the laser that fired; 0 if unknown.
  Field field = Field::kProgressive;
};

}  // namespace striper
