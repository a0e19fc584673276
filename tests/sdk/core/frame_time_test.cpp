// SPDX-License-Identifier: Apache-2.0
// Proves what a frame's time is in seconds, with and without a clock, and that a double holds the
// time of day to a quarter of a microsecond: fields and frames stay apart.
#include <cmath>
#include <cstdint>
#include <ctime>

#include <gtest/gtest.h>

#include <striper/core/frame_time.hpp>

namespace striper {
namespace {

constexpr std::int64_t kBoot_ns = 86'400'123'456'789;  // A day after the machine's start.
constexpr std::int64_t kToUtc_ns = 1'793'000'000'000'000'000 - kBoot_ns;  // In the year 2026.

TEST(FrameTime, WithoutAClockIsSinceTheFirstFrame) {
  EXPECT_EQ(FrameTime{}.seconds(), 0.0);
  EXPECT_EQ((FrameTime{1'500'000'000, {}}).seconds(), 1.5);
}

TEST(FrameTime, WithAClockIsSince1970) {
  EXPECT_NEAR((FrameTime{kBoot_ns, kToUtc_ns}).seconds(), 1.793e9, 2.5e-7);
}

TEST(FrameTime, OnTheClocksOfChrono) {
  using std::chrono::nanoseconds;
  const FrameTime time{kBoot_ns, kToUtc_ns};
  EXPECT_EQ(nanoseconds(time.steady().time_since_epoch()).count(), kBoot_ns);
  ASSERT_TRUE(time.utc().has_value());
  EXPECT_EQ(nanoseconds(time.utc()->time_since_epoch()).count(), kBoot_ns + kToUtc_ns);
  EXPECT_FALSE((FrameTime{1, {}}).utc().has_value());
}

// What `steady` is compared with is the clock that sources take their times from.
TEST(FrameTime, SteadyIsTheClockOfSources) {
  timespec now{};
  ASSERT_EQ(clock_gettime(CLOCK_MONOTONIC, &now), 0);
  const FrameTime time{now.tv_sec * 1'000'000'000 + now.tv_nsec, {}};
  const auto since = std::chrono::steady_clock::now() - time.steady();
  EXPECT_GE(since.count(), 0);
  EXPECT_LT(since, std::chrono::seconds(10));
}

// A host whose clock is set back before its start: the offset is below zero, the sum is not.
TEST(FrameTime, OffsetMayBeNegative) {
  EXPECT_DOUBLE_EQ((FrameTime{5'000'000'000, -2'000'000'000}).seconds(), 3.0);
}

// Each is within a quarter of a microsecond: half a step of a double in 2026, once of nanoseconds
// (256) and once of seconds (2^-22).
TEST(FrameTime, FramesThatFollowEachOtherStayApart) {
  for (const std::int64_t period_ns : {16'683'333, 4'000, 1'000}) {
    double last = (FrameTime{kBoot_ns, kToUtc_ns}).seconds();
    for (int n = 1; n <= 100; ++n) {
      const double now = (FrameTime{kBoot_ns + n * period_ns, kToUtc_ns}).seconds();
      EXPECT_NEAR(now - last, 1e-9 * static_cast<double>(period_ns), 5e-7);
      EXPECT_GT(now, last);
      last = now;
    }
  }
}

TEST(FrameTime, OfSecondsReadsBackToTheSameSeconds) {
  for (std::int64_t n = 0; n < 1000; ++n) {
    for (const FrameTime time : {FrameTime{kBoot_ns + n * 16'683'333, kToUtc_ns},
                                 FrameTime{n * 16'683'333, {}}, FrameTime{-n, {}}}) {
      const FrameTime back = FrameTime::at_seconds(time.seconds());
      EXPECT_EQ(back.seconds(), time.seconds());
      EXPECT_EQ(back.utc_offset_ns.has_value(), time.utc_offset_ns.has_value());
    }
  }
}

TEST(FrameTime, OfSecondsThatNoTimeHoldsIsZero) {
  for (const double seconds : {4.7e9, -4.7e9, -1e300, HUGE_VAL, std::nan("")}) {
    EXPECT_EQ(FrameTime::at_seconds(seconds).monotonic_ns, 0) << seconds;
  }
}

}  // namespace
}  // namespace striper
