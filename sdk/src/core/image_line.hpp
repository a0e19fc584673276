// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>

#include <opencv2/core/mat.hpp>

#include <striper/core/stripe_axis.hpp>

namespace striper::detail {

/// One scan line of an image, column or row, as a strided array of pixels. `Pixel` may be const.
template <typename Pixel>
struct StridedLine {
  Pixel* first = nullptr;
  std::ptrdiff_t stride = 0;  // In pixels.

  Pixel& operator[](int k) const noexcept { return first[k * stride]; }
};

/// A scan line of an image that is not written into. `Pixel` is the image's, uint8_t, uint16_t or
/// float.
template <typename Pixel>
StridedLine<const Pixel> image_line(const cv::Mat& image, StripeAxis axis, int line) noexcept {
  const auto row_stride = static_cast<std::ptrdiff_t>(image.step1());
  if (axis == StripeAxis::kColumns) return {image.ptr<Pixel>(0) + line, row_stride};
  return {image.ptr<Pixel>(line), 1};
}

/// The same of one that is.
template <typename Pixel>
StridedLine<Pixel> writable_line(cv::Mat& image, StripeAxis axis, int line) noexcept {
  const auto row_stride = static_cast<std::ptrdiff_t>(image.step1());
  if (axis == StripeAxis::kColumns) return {image.ptr<Pixel>(0) + line, row_stride};
  return {image.ptr<Pixel>(line), 1};
}

/// The largest of `n` pixels of a row; 0 of none.
template <typename Pixel>
Pixel row_maximum(const Pixel* row, int n) {
  Pixel maximum = 0;
  for (int i = 0; i < n; ++i) maximum = std::max(maximum, row[i]);
  return maximum;
}

inline int line_count(const cv::Mat& image, StripeAxis axis) noexcept {
  return axis == StripeAxis::kColumns ? image.cols : image.rows;
}

inline int line_length(const cv::Mat& image, StripeAxis axis) noexcept {
  return axis == StripeAxis::kColumns ? image.rows : image.cols;
}

}  // namespace striper::detail
