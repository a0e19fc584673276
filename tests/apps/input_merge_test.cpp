// SPDX-License-Identifier: Apache-2.0
// Proves that what several threads give comes out in the order of time, whole, and that a stream
// which is silent holds the others up no longer than its patience. The thread sanitizer runs this
// too.
#include "guide/live/input_merge.hpp"

#include <chrono>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace striper::program {
namespace {

using namespace std::chrono_literals;

TEST(InputMerge, ThreeThreadsComeOutInTheOrderOfTimeAndWhole) {
  InputMerge merge(3, 2s);
  std::vector<std::jthread> threads;
  for (std::size_t stream = 0; stream < 3; ++stream) {
    merge.give(stream, OdometerReading{0.0, 0});  // Each is waited for from the begin.
  }
  for (std::size_t stream = 0; stream < 3; ++stream) {
    threads.emplace_back([&merge, stream] {
      std::mt19937 random(static_cast<unsigned>(stream));
      for (int i = 1; i <= 2000; ++i) {
        merge.give(stream, OdometerReading{i + 0.1 * static_cast<double>(stream), i});
        if (random() % 100 == 0) std::this_thread::sleep_for(1ms);
      }
      merge.leave(stream);
    });
  }
  double last_s = 0.0;
  int number = 0;
  while (number < 3 * 2001) {
    const auto input = merge.next(5s);
    ASSERT_TRUE(input.has_value()) << number;
    ASSERT_GE(time_of(*input), last_s);
    last_s = time_of(*input);
    ++number;
  }
  EXPECT_EQ(merge.late(), 0U);
  EXPECT_FALSE(merge.next(1ms).has_value());
  merge.close();
  EXPECT_TRUE(merge.is_over());
}

TEST(InputMerge, ASilentStreamIsWaitedForNoLongerThanItsPatience) {
  InputMerge merge(2, 100ms);
  merge.give(0, OdometerReading{1.0, 1});
  merge.give(1, OdometerReading{1.0, 1});
  ASSERT_TRUE(merge.next(1s).has_value());
  ASSERT_TRUE(merge.next(1s).has_value());
  merge.give(0, OdometerReading{2.0, 2});
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(merge.next(5s).has_value());
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 1s);
  merge.give(1, OdometerReading{1.5, 2});  // Comes later than that.
  EXPECT_EQ(merge.late(), 1U);
}

// A clock is set back by ten seconds: what waits is left out, what comes is given again at once.
TEST(InputMerge, AClockThatIsSetBackBeginsAnew) {
  InputMerge merge(1, 100ms);
  merge.give(0, OdometerReading{100.0, 1});
  ASSERT_TRUE(merge.next(1s).has_value());
  merge.give(0, OdometerReading{99.5, 2});  // Late by less.
  EXPECT_EQ(merge.late(), 1U);
  EXPECT_FALSE(merge.next(1ms).has_value());
  merge.give(0, OdometerReading{90.0, 3});
  const auto input = merge.next(1s);
  ASSERT_TRUE(input.has_value());
  EXPECT_EQ(time_of(*input), 90.0);
}

TEST(InputMerge, WhatComesTooLateIsNotHeard) {
  InputMerge merge(2, 100ms);
  merge.give(0, OdometerReading{100.0, 1});
  ASSERT_TRUE(merge.next(1s).has_value());
  const auto heard = merge.heard();
  std::this_thread::sleep_for(2ms);
  merge.give(1, OdometerReading{50.0, 2});
  EXPECT_EQ(merge.heard(), heard);
}

TEST(InputMerge, AnOdometerIsHeardByItsReadingsAlone) {
  InputMerge merge(2, 100ms);
  merge.give(0, BeamSweep{});
  EXPECT_TRUE(merge.heard().has_value());
  EXPECT_FALSE(merge.heard_odometer().has_value());
  merge.give(1, OdometerReading{1.0, 1});
  EXPECT_TRUE(merge.heard_odometer().has_value());
}

}  // namespace
}  // namespace striper::program
