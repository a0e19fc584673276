// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include <striper/core/pixel_grid.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/stripe/expected_stripe.hpp>

namespace striper::detail {

/// Which pixels of an image no stripe is looked for in (ExpectedStripe::ignored).
class IgnoredPixels {
 public:
  IgnoredPixels() = default;
  /// @param expected may be null; else outlives it. @param grid of the image.
  IgnoredPixels(const ExpectedStripe* expected, const PixelGrid& grid) : grid_(grid) {
    if (expected != nullptr && !expected->ignored.empty()) sensor_ = &expected->ignored;
  }

  bool is_any() const noexcept { return sensor_ != nullptr; }

  /// Pixels outside of the mask are not ignored.
  bool has(int column, int row) const noexcept {
    if (sensor_ == nullptr) return false;
    const long u = std::lround(grid_.sensor_u(column));
    const long v = std::lround(grid_.sensor_v(row));
    if (u < 0 || v < 0 || u >= sensor_->cols || v >= sensor_->rows) return false;
    return sensor_->ptr<std::uint8_t>(static_cast<int>(v))[u] != 0;
  }

  bool has(StripeAxis axis, int line, int across) const noexcept {
    return axis == StripeAxis::kColumns ? has(line, across) : has(across, line);
  }

 private:
  const cv::Mat* sensor_ = nullptr;
  PixelGrid grid_;
};

}  // namespace striper::detail
