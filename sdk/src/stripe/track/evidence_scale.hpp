// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

namespace striper::detail {

/// What is farther away than so many pixels, widths or sigmas is not told apart, as evidence.
inline constexpr double kFarthest = 8.0;

/// The logarithm to base 2 of what is at least .001.
inline float log2_of(double value) {
  constexpr double kLeast = 1e-3;
  return static_cast<float>(std::log2(std::max(kLeast, value)));
}

/// Of two heights: what is farther apart than 32 times is not told apart.
inline float log2_ratio(double a, double b) {
  constexpr float kMost = 5.0F;
  return std::clamp(log2_of(a / b), -kMost, kMost);
}

inline float at_most(double most, double value) {
  return static_cast<float>(std::min(most, value));
}

}  // namespace striper::detail
