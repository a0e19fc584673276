// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace striper::testing {

/// What a pixel sees of light that jumps at an edge, through the lens and its own box: by the
/// midpoint rule, the edge between two of its steps.
template <typename Light>
double seen_of_edge(const Light& light, double edge, double pixel, double blur_px) {
  constexpr double kStep_px = 1.0 / 40.0;
  const double reach_px = 5.0 * blur_px + 0.5;
  const auto first = static_cast<int>(std::floor((pixel - reach_px - edge) / kStep_px));
  const auto last = static_cast<int>(std::ceil((pixel + reach_px - edge) / kStep_px));
  double sum = 0.0;
  double weights = 0.0;
  for (int i = first; i <= last; ++i) {
    const double x = edge + (i + 0.5) * kStep_px;
    const double per_sigma = 1.0 / (blur_px * std::sqrt(2.0));
    const double weight =
        std::erf((0.5 + x - pixel) * per_sigma) + std::erf((0.5 - x + pixel) * per_sigma);
    sum += weight * light(x);
    weights += weight;
  }
  return sum / weights;
}

}  // namespace striper::testing
