// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

namespace striper::detail {

/// What a return may be off by, to be right: half a pixel, or three of its sigmas.
inline float right_within_px(float sigma_px) noexcept {
  constexpr float kRight_px = 0.5F;
  constexpr float kRightSigmas = 3.0F;
  return std::max(kRight_px, kRightSigmas * sigma_px);
}

/// What is no farther from a stripe of that width still belongs to it: noise, textures and edges
/// move it so far.
inline float near_within_px(float width_px) noexcept {
  constexpr float kNear_px = 2.5F;
  constexpr float kNearWidths = 1.2F;
  return std::max(kNear_px, kNearWidths * width_px);
}

/// The sigma of what may be anywhere within that, and the greatest that a return has: a greater one
/// would count distant things as right.
inline float most_sigma_px(float width_px) noexcept {
  constexpr float kOfEvenDensity = 0.57735027F;  // 1 / sqrt(3).
  return kOfEvenDensity * near_within_px(width_px);
}

}  // namespace striper::detail
