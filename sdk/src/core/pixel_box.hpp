// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

namespace striper::detail {

/// Variance of the place within a pixel that light falls on: a box one pixel wide, pixels squared.
inline constexpr double kPixelBox2 = 1.0 / 12.0;

/// One sigma of a Gaussian after the pixels have integrated it, px: 1 % off at 0.5 px, exact for
/// wide ones.
inline double with_pixel_box(double sigma_px) noexcept {
  return std::sqrt(sigma_px * sigma_px + kPixelBox2);
}

/// What it was before. Light narrower than 0.2 px looks like a pixel and is taken for that wide.
inline double without_pixel_box(double sigma_px) noexcept {
  constexpr double kNarrowest_px = 0.2;
  return std::sqrt(std::max(kNarrowest_px * kNarrowest_px, sigma_px * sigma_px - kPixelBox2));
}

}  // namespace striper::detail
