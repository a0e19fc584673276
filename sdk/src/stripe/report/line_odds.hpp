// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace striper::detail {

/// Log odds of a scan line that has no return, where each scan line has some.
inline constexpr float kNoReturn = -9.0F;

/// The mean of a scan line's log odds and of those so many to either side that there are.
inline float mean_odds_about(std::span<const float> odds, std::size_t line,
                             std::size_t reach) noexcept {
  const std::size_t first = line - std::min(line, reach);
  const std::size_t last = std::min(odds.size() - 1, line + reach);
  float sum = 0.0F;
  for (std::size_t other = first; other <= last; ++other) sum += odds[other];
  return sum / static_cast<float>(last - first + 1);
}

}  // namespace striper::detail
