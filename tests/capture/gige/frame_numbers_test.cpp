// SPDX-License-Identifier: Apache-2.0
// Proves that block ids of every kind of device become one sequence without wraps, with the gaps
// counted and the illumination pattern in step.
#include "gige/pictures/frame_numbers.hpp"

#include <gtest/gtest.h>

namespace striper::detail {
namespace {

TEST(FrameNumbers, CountFromZeroAndTellGaps) {
  FrameNumbers numbers;
  EXPECT_EQ(numbers.next(1).sequence, 0u);
  EXPECT_EQ(numbers.next(2).sequence, 1u);
  const auto after_gap = numbers.next(5);
  EXPECT_EQ(after_gap.sequence, 4u);
  EXPECT_EQ(after_gap.missing, 2u);
  EXPECT_EQ(after_gap.since_start, 4u);
}

TEST(FrameNumbers, FirstFramesThatAreLostAreMissing) {
  FrameNumbers numbers;
  const auto first = numbers.next(3);
  EXPECT_EQ(first.sequence, 2u);
  EXPECT_EQ(first.missing, 2u);
}

TEST(FrameNumbers, ADeviceThatNeverRestartsItsCountBeginsAtZero) {
  FrameNumbers numbers;
  EXPECT_EQ(numbers.next(4711).sequence, 0u);
  EXPECT_EQ(numbers.next(4712).sequence, 1u);
}

TEST(FrameNumbers, SixteenBitsWrapToOne) {
  FrameNumbers numbers;
  numbers.next(65534);
  EXPECT_EQ(numbers.next(65535).sequence, 1u);
  EXPECT_EQ(numbers.next(1).sequence, 2u);
  EXPECT_TRUE(numbers.next(65535).is_late);
  EXPECT_EQ(numbers.next(4).sequence, 5u);
}

TEST(FrameNumbers, SixteenBitsWrapToZeroWhereTheDeviceCountsSo) {
  FrameNumbers numbers;
  numbers.next(65535);
  EXPECT_EQ(numbers.next(0).sequence, 1u);
  EXPECT_EQ(numbers.next(1).sequence, 2u);
}

TEST(FrameNumbers, ExtendedIdsDoNotWrap) {
  FrameNumbers numbers;
  numbers.next(65535);
  EXPECT_EQ(numbers.next(65536).sequence, 1u);
  EXPECT_EQ(numbers.next(70000).sequence, 4465u);
}

TEST(FrameNumbers, WhatComesLateIsNoWrap) {
  FrameNumbers numbers;
  numbers.next(1);
  numbers.next(5);
  for (const std::uint64_t id : {3u, 5u}) {
    const auto late = numbers.next(id);
    EXPECT_TRUE(late.is_late);
    EXPECT_EQ(late.sequence, id - 1);
    EXPECT_EQ(late.missing, 0u);
  }
  const auto after = numbers.next(6);
  EXPECT_FALSE(after.is_late);
  EXPECT_EQ(after.sequence, 5u);
}

TEST(FrameNumbers, GoOnInStepWithThePatternAfterARestart) {
  for (const std::uint64_t length : {1u, 2u, 3u, 4u}) {
    FrameNumbers numbers(length);
    for (std::uint64_t id = 1; id <= 7; ++id) numbers.next(id);
    numbers.restart(10);
    const auto first = numbers.next(1);
    EXPECT_EQ(first.since_start, 0u);
    EXPECT_EQ(first.sequence % length, 0u);
    EXPECT_GE(first.sequence, 17u);
    EXPECT_EQ(first.missing, first.sequence - 7);
  }
}

TEST(FrameNumbers, ARestartBeforeAnyFrameChangesNothing) {
  FrameNumbers numbers(2);
  numbers.restart(100);
  EXPECT_EQ(numbers.next(1).sequence, 0u);
}

}  // namespace
}  // namespace striper::detail
