// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace striper::detail {

/// How far each place of a band rises above both of its sides in `over - under`, in sigmas. All of
/// `heights.size()` samples; beyond the ends the last ones are repeated.
struct BandHeights {
  const float* over;  ///< Smoothed.
  const float* under;
  const float* over_side;  ///< Means of a few samples.
  const float* under_side;
  const float* variance;  ///< Of the difference beyond noise; may be null.
  float noise;            ///< Of a height, as one sigma.
  int side;               ///< How far off the sides are.

  /// Through the best instruction set.
  void measure(std::span<float> heights) const;
};

/// One step of LinePath: next[i] = heights[i], no less than `lowest` and no more than `highest`,
/// plus the largest best[i + j] - toll |j| of all |j| <= jump. Through the best instruction set.
///
/// @param best readable for `jump` places before and after its own. @param next none of it is read.
struct PathStep {
  const float* best;
  float* next;
  int jump;
  float toll;
  float lowest;
  float highest;

  void take(std::span<const float> heights) const;
};

}  // namespace striper::detail
