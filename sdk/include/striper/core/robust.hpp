// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>

namespace striper {

/// One sigma of a normal distribution over the median of its absolute values.
inline constexpr double kSigmaOfMedianAbsolute = 1.4826;

/// Returns the median, of an even number of values the upper one, and leaves them in another order.
/// Precondition: there are any. No allocation; linear.
/// @param values a range with random access.
template <typename Range>
auto upper_median(Range& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns one sigma of normally distributed values of mean zero, of which less than half may be
/// anything, from their absolute values; see `upper_median`.
template <typename Range>
double robust_sigma(Range& absolute_values) {
  return kSigmaOfMedianAbsolute * static_cast<double>(upper_median(absolute_values));
}

}  // namespace striper
