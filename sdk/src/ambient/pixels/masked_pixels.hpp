// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core/mat.hpp>

namespace striper::detail {

/// Marks where a stripe could not be seen: saturated in a dark exposure, or in the lit one where no
/// stripe can be so (a long run, or near a light source), and a few pixels around. A light source
/// that is elsewhere in the other exposures leaves its flare in the difference, as bright as a
/// stripe (or as dark): that is marked as far as it reaches.
///
/// Rows are announced with what saturates in them; only those are looked at again. No allocation
/// after the first frames of a size. Not thread-safe.
class MaskedPixels {
 public:
  void prepare(cv::Size size);

  /// Says which exposures saturate somewhere in a row.
  void set_row(int row, bool in_lit, bool in_dark) noexcept;

  /// @param before, after dark exposures, either may be null. @param dark what is subtracted from
  /// `lit`.
  /// @return CV_8UC1, non-zero where masked, valid until the next call; empty where nothing is.
  cv::Mat find(const cv::Mat& lit, const cv::Mat* before, const cv::Mat* after, const cv::Mat& dark,
               int full_scale_dn);

 private:
  template <typename Pixel>
  bool mark(const cv::Mat& lit, const cv::Mat* before, const cv::Mat* after, int full_scale_dn);
  template <typename Pixel>
  void mark_dark_row(const Pixel* pixels, int row, std::uint8_t exposure, int full_scale_dn);
  template <typename Pixel>
  bool mark_lit_rows(const cv::Mat& lit, int full_scale_dn);
  bool is_near_light_source(int row, int col) const;
  bool have_light_sources_moved() const;
  template <typename Pixel>
  void mark_flares(const cv::Mat& lit, const cv::Mat& dark);
  cv::Rect take_blob(int row, int col, bool& stands);
  void mask_out(const cv::Rect& box);
  void dilate();

  int block_rows_ = 0;
  int block_cols_ = 0;
  cv::Mat masked_;
  cv::Mat marked_;                           // Saturated pixels before dilation.
  int light_source_reach_ = 0;               // In blocks.
  std::vector<std::uint8_t> light_sources_;  // Per block: which dark exposures saturate.
  std::vector<std::uint8_t> saturated_;      // Per row: in the lit, in a dark exposure.
  std::vector<cv::Point> blob_;              // Scratch.
  std::vector<int> run_;  // Per column: length of the saturated run that ends here.
};

}  // namespace striper::detail
