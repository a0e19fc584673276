// SPDX-License-Identifier: Apache-2.0
// Proves that the kernels of the search for a stripe do what their plain loops do, on every
// instruction set of this machine and for every length that fills a vector or not. What they are
// good for is proven in pattern_finder_test.cpp.
#include "ambient/pixels/line_kernels.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <vector>

#include <gtest/gtest.h>

#include "support/instruction_sets.hpp"
#include "support/random.hpp"

namespace striper::detail {
namespace {

constexpr int kLongest = 70;

std::vector<float> numbers(std::size_t count, double low, double high) {
  std::vector<float> values;
  for (std::size_t i = 0; i < count; ++i) {
    values.push_back(static_cast<float>(testing::uniform(low, high)));
  }
  return values;
}

TEST(LineKernels, HeightsAreThoseOfThePlainLoop) {
  testing::for_each_instruction_set([] {
    for (int length = 1; length <= kLongest; ++length) {
      const auto n = static_cast<std::size_t>(length);
      const auto over = numbers(n, 0.0, 100.0);
      const auto under = numbers(n, 0.0, 100.0);
      const auto over_side = numbers(n, 0.0, 100.0);
      const auto under_side = numbers(n, 0.0, 100.0);
      const auto variance = numbers(n, 0.0, 10.0);
      for (const bool has_variance : {false, true}) {
        std::vector<float> heights(n);
        const BandHeights band{over.data(),
                               under.data(),
                               over_side.data(),
                               under_side.data(),
                               has_variance ? variance.data() : nullptr,
                               1.5F,
                               7};
        band.measure(heights);
        for (int i = 0; i < length; ++i) {
          const auto side = [&](int at) {
            const auto k = static_cast<std::size_t>(std::clamp(at, 0, length - 1));
            return over_side[k] - under_side[k];
          };
          const auto k = static_cast<std::size_t>(i);
          const float extra = has_variance ? variance[k] : 0.0F;
          const float expected =
              (over[k] - under[k] - std::max(side(i - 7), side(i + 7))) / std::sqrt(2.25F + extra);
          EXPECT_NEAR(heights[k], expected, 1e-4) << length << ' ' << i;
        }
      }
    }
  });
}

TEST(LineKernels, StepOfAPathIsThatOfThePlainLoop) {
  constexpr float kUntouched = -7.0F;
  testing::for_each_instruction_set([&] {
    for (int places = 1; places <= kLongest; ++places) {
      for (const int jump : {0, 1, 4}) {
        const auto n = static_cast<std::size_t>(places);
        const auto best = numbers(n + 2 * static_cast<std::size_t>(jump), -5.0, 5.0);
        const auto heights = numbers(n, -3.0, 8.0);
        std::vector<float> next(n + 2, kUntouched);
        const float* const middle = best.data() + jump;
        PathStep{middle, next.data() + 1, jump, 0.2F, -1.0F, 5.0F}.take(heights);
        for (int i = 0; i < places; ++i) {
          float highest = middle[i];
          for (int j = -jump; j <= jump; ++j) {
            highest = std::max(highest, middle[i + j] - 0.2F * static_cast<float>(std::abs(j)));
          }
          const auto k = static_cast<std::size_t>(i);
          EXPECT_NEAR(next[k + 1], highest + std::clamp(heights[k], -1.0F, 5.0F), 1e-5)
              << places << ' ' << jump << ' ' << i;
        }
        EXPECT_EQ(next.front(), kUntouched);
        EXPECT_EQ(next.back(), kUntouched);
      }
    }
  });
}

}  // namespace
}  // namespace striper::detail
