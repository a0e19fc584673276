// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/core/noise_model.hpp>

namespace striper::detail {

/// Tells where a scene moves: by how much more than noise exposures differ, block by block.
///
/// With a dark exposure on either side of the lit one the two are compared, which knows nothing of
/// the stripe. With one only, the lit exposure is compared with it: what is darker cannot be the
/// stripe's light, nor can what is brighter over more rows than a stripe has. No allocation after
/// the first frames of a size. Not thread-safe.
class Motion {
 public:
  /// Blocks: enough pixels to tell motion from noise, small enough to be local.
  static constexpr int kCols = 16;
  static constexpr int kRows = 8;

  void prepare(cv::Size size);
  int strips() const noexcept { return rows_; }

  /// Compares `kRows` rows of two dark exposures, strip by strip.
  void compare_strip(const cv::Mat& before, const cv::Mat& after, int strip);

  /// After all strips: leaves out what is masked, which no variance needs to hide. @param masked
  /// CV_8UC1, non-zero where it is so.
  void leave_out(const cv::Mat& before, const cv::Mat& after, const cv::Mat& masked);

  /// Compares a lit exposure with what is subtracted from it. @param known variance of the
  /// difference beyond noise that is no motion's, CV_32FC1; may be empty.
  void compare_with_lit(const cv::Mat& lit, const cv::Mat& dark, const cv::Mat& known);

  /// The variance of an exposure's noise, from the blocks of dark exposures that differ least.
  double noise_of_quietest_blocks();

  /// Leaves what noise does not explain. @param dark_noise_gain of the second exposure, in parts of
  /// the first one's.
  void keep_beyond(const NoiseModel& noise, double dark_noise_gain);

  /// Adds the motion of each block and its neighbours, times `factor`, to `variance` (CV_32FC1).
  /// Returns whether there was any.
  bool add_to(cv::Mat& variance, double factor);

  /// Sets the blocks that were added to to 0.
  void clear(cv::Mat& variance);

 private:
  template <typename Pixel>
  void compare_pixels(const cv::Mat& a, const cv::Mat& b, int strip);
  template <typename Pixel>
  void compare_seen(const cv::Mat& a, const cv::Mat& b, const cv::Mat& masked);
  template <typename Matrix, typename Action>
  void for_rows_of(Matrix& variance, int row, int col, const Action& action) const;
  std::size_t index(int row, int col) const noexcept {
    return static_cast<std::size_t>(row * cols_ + col);
  }
  float excess_around(int row, int col) const;
  float most_around(int row, int col) const;
  float mean_of(const cv::Mat& variance, int row, int col) const;

  cv::Size size_;
  int rows_ = 0;
  int cols_ = 0;
  std::vector<float> squares_;     // Per block: mean square difference,
  std::vector<float> brighter_;    // twice the mean square of what is brighter in the first one,
  std::vector<float> level_;       // mean of the first one.
  std::vector<float> expected_;    // What noise makes of `squares_`,
  std::vector<float> excess_;      // and what there is beyond it.
  std::vector<std::uint8_t> has_;  // Was added to the variance.
  std::vector<float> sorted_;      // Scratch.
};

}  // namespace striper::detail
