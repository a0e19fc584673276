// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/core/stripe_axis.hpp>

#include "ambient/pixels/line_path.hpp"

namespace striper::detail {

/// Tells from a sample of bands of lines whether `over - under` has a narrow bright line across
/// the picture, or a dark one: the laser was on in the first image, or in the second. Something
/// that moves makes both.
///
/// No allocation after the first images of a size. Not thread-safe. Cost: half a
/// reading of both images of 640 columns, less of wider ones.
class LineSign {
 public:
  static constexpr float kLine = 1.5F;
  static constexpr float kSurplus = 0.8F;

  /// In sigmas a band: noise finds itself paths of about 0.4, a clear line has up to 5.
  struct Strength {
    float bright = 0.0F;
    float dark = 0.0F;

    bool is_dark() const { return dark > kLine && dark > bright + kSurplus; }
    bool is_bright() const { return bright > kLine && bright > dark + kSurplus; }
    bool is_plainly_bright() const { return bright > 2.0F * kLine && is_bright(); }
    bool is_nothing() const { return bright < 0.5F * kLine && dark < 0.5F * kLine; }
  };

  /// @param over, under of one size and type, CV_8UC1 or CV_16UC1. @param variance of the
  /// difference beyond noise, CV_32FC1; may be empty.
  Strength of(const cv::Mat& over, const cv::Mat& under, const cv::Mat& variance, StripeAxis axis);

 private:
  template <typename Pixel>
  void average_bands(const cv::Mat& over, const cv::Mat& under, StripeAxis axis);
  template <typename Pixel, typename Width>
  void add_columns(const cv::Mat& over, const cv::Mat& under, Width any_width);
  template <typename Pixel>
  void add_rows(const cv::Mat& over, const cv::Mat& under);
  void find_heights();
  float noise_of_heights();
  float strength(const std::vector<float>& heights, float noise, const cv::Mat& variance,
                 StripeAxis axis);

  cv::Size size_;  // Of the images.
  int bands_ = 0;
  int length_ = 0;             // Places of a band that have both sides.
  std::vector<float> values_;  // [band][pixel]: over - under, the mean of a few lines.
  std::vector<float> bright_;  // [band][place]: above both sides,
  std::vector<float> dark_;    // and below both.
  LinePath path_;
  std::vector<float> sigmas_;  // Scratch.
  std::vector<float> folded_;  // Scratch.
  std::vector<float> sorted_;  // Scratch.
};

}  // namespace striper::detail
