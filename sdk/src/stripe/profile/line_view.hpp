// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "core/image_line.hpp"

namespace striper::detail {

/// Where the pixels of a scan line are on the sensor.
inline const AxisGrid& grid_across(const PixelGrid& grid, StripeAxis axis) noexcept {
  return axis == StripeAxis::kColumns ? grid.v : grid.u;
}

/// One scan line of a lit frame with its dark reference subtracted and its clipped pixels known.
template <typename Pixel>
class LitLine {
 public:
  LitLine(const LitFrame& frame, StripeAxis axis, int line) noexcept
      : lit_(image_line<Pixel>(frame.lit, axis, line)),
        length_(line_length(frame.lit, axis)),
        full_scale_(frame.full_scale_dn) {
    if (!frame.dark.empty()) dark_ = image_line<Pixel>(frame.dark, axis, line);
    if (!frame.masked.empty()) masked_ = image_line<std::uint8_t>(frame.masked, axis, line);
  }

  int length() const noexcept { return length_; }

  /// Lit minus dark, DN; negative where noise makes it so.
  int value(int k) const noexcept { return lit(k) - dark(k); }

  int lit(int k) const noexcept { return lit_[k]; }
  int dark(int k) const noexcept { return dark_.first != nullptr ? dark_[k] : 0; }

  bool clipped(int k) const noexcept { return lit_[k] >= full_scale_; }
  bool masked(int k) const noexcept { return masked_.first != nullptr && masked_[k] != 0; }

 private:
  StridedLine<const Pixel> lit_;
  StridedLine<const Pixel> dark_;
  StridedLine<const std::uint8_t> masked_;
  int length_;
  int full_scale_;
};

}  // namespace striper::detail
