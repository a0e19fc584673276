// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <opencv2/core/mat.hpp>

namespace striper::detail {

/// What stays the same over time in the images of a static sensor: an approximate running median
/// per pixel, which moves by one grey level per image towards what it sees (McFarlane & Schofield
/// 1995). It begins as the median of the first few images. Not thread-safe.
class TemporalBackground {
 public:
  static constexpr std::size_t kFirstImages = 5;

  /// Its noise variance in parts of an image's: 0.29 for the median of five; a median that steps
  /// by one grey level has sqrt(pi / 8) of a level times the image's sigma, which is about as
  /// much.
  static constexpr float kNoiseGain = 0.3F;

  bool is_empty() const noexcept { return background_.empty(); }

  /// Begins with the median of at least one and at most `kFirstImages` images of a size.
  void begin(const std::vector<cv::Mat>& images);

  /// Follows the next image. @param step_dn at least 1. Begins anew where size or type changed.
  const cv::Mat& follow(const cv::Mat& image, int step_dn);

 private:
  cv::Mat background_;
};

}  // namespace striper::detail
