// SPDX-License-Identifier: Apache-2.0
// Proves order statistics against sorting, on any range, and that the robust sigma is that of a
// normal distribution and holds while less than half of the values are anything.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/robust.hpp>

#include "support/random.hpp"

namespace striper {
namespace {

std::vector<double> random_values(std::size_t count) {
  std::vector<double> values(count);
  // Few different ones, so that many are equal.
  for (double& value : values) value = std::floor(testing::uniform(0.0, 9.0));
  return values;
}

TEST(NthSmallest, IsWhatSortingPutsThere) {
  for (const std::size_t count : {1U, 2U, 3U, 10U, 257U}) {
    const std::vector<double> values = random_values(count);
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t at = 0; at < count; ++at) {
      std::vector<double> scratch = values;
      EXPECT_EQ(nth_smallest(scratch, at), sorted[at]);
      std::sort(scratch.begin(), scratch.end());
      EXPECT_EQ(scratch, sorted) << "in another order, but all there";
    }
  }
}

TEST(UpperMedian, IsTheUpperOneOfAnEvenNumber) {
  std::vector<int> even{4, 1, 3, 2};
  EXPECT_EQ(upper_median(even), 3);
  std::array<float, 3> odd{5.0F, 1.0F, 2.0F};
  EXPECT_EQ(upper_median(odd), 2.0F);
  std::vector<int> single{7};
  EXPECT_EQ(upper_median(single), 7);
}

TEST(UpperMedian, OfAPartLeavesTheRest) {
  std::array<int, 6> values{9, 8, 7, -1, -2, -3};
  std::span part(values.data(), 3);
  EXPECT_EQ(upper_median(part), 8);
  EXPECT_EQ(values[3], -1);
  EXPECT_EQ(values[5], -3);
}

TEST(RobustSigma, IsTheSigmaOfNormalValuesWhateverAThirdOfThemIs) {
  constexpr std::size_t kCount = 20'000;
  // Relative standard error of the median absolute value, 1.17 / sqrt(n), four times.
  constexpr double kFourSigmas = 4.0 * 1.17 / 141.4;
  std::vector<double> magnitudes(kCount);
  for (double& value : magnitudes) value = std::abs(testing::normal(0.0, 2.5));
  EXPECT_NEAR(robust_sigma(magnitudes), 2.5, 2.5 * kFourSigmas);

  for (std::size_t i = 0; i < kCount; ++i) {
    magnitudes[i] = i % 3 == 0 ? 1e9 : std::abs(testing::normal(0.0, 2.5));
  }
  // Three quarters of the good ones are then below the middle: 1.150 sigma.
  EXPECT_NEAR(robust_sigma(magnitudes), 2.5 * 1.4826 * 1.1503, 2.5 * 1.4826 * 1.1503 * 0.04);
}

}  // namespace
}  // namespace striper
