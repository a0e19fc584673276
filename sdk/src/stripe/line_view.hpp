// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>

#include <opencv2/core/mat.hpp>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper::detail {

/// One line of an image, column or row, as a strided array of pixels. `Pixel` is uint8_t or
/// uint16_t.
template <typename Pixel>
struct StridedLine {
  const Pixel* first = nullptr;
  std::ptrdiff_t stride = 0;  // In pixels.

  Pixel operator[](int k) const noexcept { return first[k * stride]; }
};

template <typename Pixel>
StridedLine<Pixel> image_line(const cv::Mat& image, StripeAxis axis, int line) noexcept {
  const auto row_stride = static_cast<std::ptrdiff_t>(image.step1());
  if (axis == StripeAxis::kColumns) return {image.ptr<Pixel>(0) + line, row_stride};
  return {image.ptr<Pixel>(line), 1};
}

inline int line_count(const cv::Mat& image, StripeAxis axis) noexcept {
  return axis == StripeAxis::kColumns ? image.cols : image.rows;
}

inline int line_length(const cv::Mat& image, StripeAxis axis) noexcept {
  return axis == StripeAxis::kColumns ? image.rows : image.cols;
}

/// Where the pixels of a line are on the sensor.
inline const AxisGrid& grid_across(const PixelGrid& grid, StripeAxis axis) noexcept {
  return axis == StripeAxis::kColumns ? grid.v : grid.u;
}

/// One line of a lit frame with its dark reference taken off and its clipped pixels known.
template <typename Pixel>
class LitLine {
 public:
  LitLine(const LitFrame& frame, StripeAxis axis, int line) noexcept
      : lit_(image_line<Pixel>(frame.lit, axis, line)),
        length_(line_length(frame.lit, axis)),
        full_scale_(frame.full_scale_dn) {
    if (!frame.dark.empty()) dark_ = image_line<Pixel>(frame.dark, axis, line);
    if (!frame.blind.empty()) blind_ = image_line<std::uint8_t>(frame.blind, axis, line);
  }

  int length() const noexcept { return length_; }

  /// Lit minus dark, DN; negative where noise makes it so.
  int value(int k) const noexcept { return lit(k) - dark(k); }

  int lit(int k) const noexcept { return lit_[k]; }
  int dark(int k) const noexcept { return dark_.first != nullptr ? dark_[k] : 0; }

  bool clipped(int k) const noexcept { return lit_[k] >= full_scale_; }
  bool blind(int k) const noexcept { return blind_.first != nullptr && blind_[k] != 0; }

 private:
  StridedLine<Pixel> lit_;
  StridedLine<Pixel> dark_;
  StridedLine<std::uint8_t> blind_;
  int length_;
  int full_scale_;
};

}  // namespace striper::detail
