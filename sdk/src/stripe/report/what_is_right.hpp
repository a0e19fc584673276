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

}  // namespace striper::detail
