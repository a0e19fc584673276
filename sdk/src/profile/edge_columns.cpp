// SPDX-License-Identifier: Apache-2.0
#include "profile/edge_columns.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace striper::detail {
namespace {

constexpr std::size_t kLookedAt = 5;
// A whole column is at least so bright beside what is further inside; speckle of 5 %, twice.
constexpr float kWholePart = 0.9F;
// Neighbours whose distances differ by more than this part are on two surfaces, or on one so steep
// that its own columns differ in brightness.
constexpr double kJump = 0.02;

bool is_break(const InverseRanges& ranges, std::size_t left) noexcept {
  if (ranges.index[left + 1] != ranges.index[left] + 1) return true;
  const double a = ranges.q[left];
  const double b = ranges.q[left + 1];
  return std::abs(a - b) > kJump * std::min(a, b);
}

}  // namespace

float brightness_inside(const InverseRanges& ranges, std::size_t from, std::size_t to,
                        bool is_end) noexcept {
  if (to - from < kMostMixed + kLookedAt) return 0.0F;
  std::array<float, kLookedAt> seen{};
  for (std::size_t k = 0; k < kLookedAt; ++k)
    seen[k] = ranges.intensity[is_end ? to - 1 - kMostMixed - k : from + kMostMixed + k];
  const auto middle = seen.begin() + kLookedAt / 2;
  std::nth_element(seen.begin(), middle, seen.end());
  return *middle;
}

const std::vector<char>& EdgeColumns::mark(const InverseRanges& ranges) {
  marked_.assign(ranges.size(), 0);
  std::size_t from = 0;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const bool is_last = i + 1 == ranges.size();
    if (!is_last && !is_break(ranges, i)) continue;
    if (from > 0) mark_end(ranges, from, i + 1, false);
    if (!is_last) mark_end(ranges, from, i + 1, true);
    from = i + 1;
  }
  return marked_;
}

void EdgeColumns::mark_end(const InverseRanges& ranges, std::size_t from, std::size_t to,
                           bool is_end) {
  const float whole = kWholePart * brightness_inside(ranges, from, to, is_end);
  for (std::size_t k = 0; k < kMostMixed; ++k) {
    const std::size_t i = is_end ? to - 1 - k : from + k;
    if (i < from || i >= to || ranges.intensity[i] >= whole) return;
    marked_[i] = 1;
  }
}

}  // namespace striper::detail
