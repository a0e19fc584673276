// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <opencv2/core/mat.hpp>

#include <striper/simulator/imager.hpp>

namespace striper::detail {

/// Expected electrons of one exposure, per pixel that is read out (after binning), CV_32FC1.
struct Charge {
  cv::Mat daylight;
  cv::Mat laser;  ///< Empty for a dark exposure.
  cv::Mat gains;  ///< From `pixel_gains`.
  std::uint64_t exposure_number = 0;
};

/// Which rows of the frame an exposure fills, and where they go in the image.
struct RowRange {
  int first = 0;  ///< Of the frame.
  int step = 1;
  int image_first = 0;
  int image_step = 1;
};

/// Sums electrons over bins; returns the image itself for 1 x 1.
cv::Mat binned(const cv::Mat& electrons, cv::Size binning);

/// How much each pixel of an image makes of its light (photo response non-uniformity), CV_64FC1:
/// the same in every exposure. Empty where all are alike.
cv::Mat pixel_gains(cv::Size image, const Imager& imager, std::uint64_t seed);

/// Adds scattered light: a part of all light goes into a wide Gaussian.
cv::Mat bloomed(const cv::Mat& electrons, const Bloom& bloom);

/// Reads the sensor out: noise, gain, black level, rounding and clipping, into 8- or 16-bit pixels.
void read_out(const Charge& charge, const Imager& imager, std::uint64_t seed, const RowRange& rows,
              cv::Mat& image);

/// The same without noise, rounding and clipping, into CV_32FC1.
void read_out_expected(const Charge& charge, const Imager& imager, const RowRange& rows,
                       cv::Mat& image);

/// Electrons at which a pixel stops to tell more from less.
double saturation_electrons(const Imager& imager) noexcept;

}  // namespace striper::detail
