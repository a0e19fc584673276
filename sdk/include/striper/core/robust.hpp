// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>

namespace striper {

/// One sigma of a normal distribution over the median of its absolute values.
inline constexpr double kSigmaOfMedianAbsolute = 1.4826;

/// Returns the value that `at` of the others come before in order, and leaves them in another
/// order. Precondition: there are more than `at`. No allocation; linear.
/// @param values a range with random access.
template <typename Range>
auto nth_smallest(Range& values, std::size_t at) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(at);
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

/// Returns the median, of an even number of values the upper one, and leaves them in another order.
/// Precondition: there are any. No allocation; linear.
template <typename Range>
auto upper_median(Range& values) {
  return nth_smallest(values, values.size() / 2);
}

/// Returns one sigma of normally distributed values of mean zero, of which less than half may be
/// anything, from their absolute values; see `upper_median`.
template <typename Range>
double robust_sigma(Range& absolute_values) {
  return kSigmaOfMedianAbsolute * static_cast<double>(upper_median(absolute_values));
}

}  // namespace striper
