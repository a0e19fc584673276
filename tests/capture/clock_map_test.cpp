// SPDX-License-Identifier: Apache-2.0
// Proves that a device's clock is tracked through skew, jitter, bursts of delay, pauses and steps,
// against a simulated clock whose truth is known. Does not prove anything of a real camera's clock,
// whose rate also wanders with its temperature.
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include <striper/capture/clock_map.hpp>

#include "support/random.hpp"

namespace striper {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

/// A device clock of which everything is known.
struct SkewedClock {
  double skew = 0.0;
  std::int64_t offset_ns = 0;

  std::int64_t device_ns(std::int64_t host_ns) const {
    return offset_ns + host_ns + static_cast<std::int64_t>(skew * static_cast<double>(host_ns));
  }
};

/// Never negative, usually short, sometimes very long: what a busy computer does to packets.
std::int64_t delay_ns() {
  const double usual_us = -200.0 * std::log(1.0 - testing::uniform(0.0, 1.0));
  const double stall_us = testing::uniform(0.0, 1.0) < 0.02 ? testing::uniform(1e3, 5e4) : 0.0;
  return static_cast<std::int64_t>(1e3 * (usual_us + stall_us));
}

/// Largest error of the map over the observations after `settle_ns`, nanoseconds.
std::int64_t worst_error_ns(ClockMap& map, const SkewedClock& clock, std::int64_t begin_ns,
                            std::int64_t end_ns, std::int64_t period_ns, std::int64_t settle_ns) {
  std::int64_t worst = 0;
  for (std::int64_t host = begin_ns; host < end_ns; host += period_ns) {
    const std::int64_t device = clock.device_ns(host);
    map.observe(device, host + delay_ns());
    if (host - begin_ns < settle_ns) continue;
    worst = std::max(worst, std::abs(map.to_host(device) - host));
  }
  return worst;
}

TEST(ClockMap, FollowsASkewedAndJitteredClock) {
  for (const double skew : {-2e-4, -3e-5, 0.0, 3e-5, 2e-4}) {
    ClockMap map;
    const SkewedClock clock{skew, -7 * kSecond};
    const std::int64_t worst =
        worst_error_ns(map, clock, 1000 * kSecond, 1100 * kSecond, kSecond / 100, 5 * kSecond);
    EXPECT_LT(worst, 150'000) << "skew " << skew;
    EXPECT_NEAR(map.rate(), 1.0 / (1.0 + skew), 5e-6) << "skew " << skew;
    EXPECT_EQ(map.steps(), 0u);
  }
}

TEST(ClockMap, IsExactWithoutJitter) {
  ClockMap map;
  const SkewedClock clock{1e-4, 123456789};
  for (std::int64_t i = 0; i < 500; ++i) {
    const std::int64_t host = i * kSecond / 10;
    map.observe(clock.device_ns(host), host);
  }
  EXPECT_NEAR(static_cast<double>(map.to_host(clock.device_ns(60 * kSecond))), 60e9, 200.0);
}

TEST(ClockMap, OneObservationGivesTheOffset) {
  ClockMap map;
  EXPECT_FALSE(map.is_ready());
  map.observe(1000, 5000);
  ASSERT_TRUE(map.is_ready());
  EXPECT_EQ(map.to_host(1000), 5000);
  EXPECT_EQ(map.to_host(3000), 7000);
}

TEST(ClockMap, AStalledHostDoesNotMoveIt) {
  ClockMap map;
  const SkewedClock clock{5e-5, kSecond};
  worst_error_ns(map, clock, 0, 10 * kSecond, kSecond / 200, 0);
  // The program sleeps for 0.8 s; then everything that waited arrives at once.
  const std::int64_t wakes = 10 * kSecond + 8 * kSecond / 10;
  for (std::int64_t host = 10 * kSecond; host < wakes; host += kSecond / 200) {
    map.observe(clock.device_ns(host), wakes);
  }
  EXPECT_EQ(map.steps(), 0u);
  EXPECT_LT(std::abs(map.to_host(clock.device_ns(wakes)) - wakes), 150'000);
}

TEST(ClockMap, StartsAnewAtOnceWhenTheDeviceRestarts) {
  ClockMap map;
  worst_error_ns(map, {1e-5, 500 * kSecond}, 0, 10 * kSecond, kSecond / 100, 0);
  const SkewedClock restarted{1e-5, -10 * kSecond};
  map.observe(restarted.device_ns(10 * kSecond), 10 * kSecond);
  EXPECT_EQ(map.steps(), 1u);
  EXPECT_LT(std::abs(map.to_host(restarted.device_ns(10 * kSecond)) - 10 * kSecond), 1000);
}

TEST(ClockMap, NoticesStepsOfTheClockForwardsAndBackwards) {
  for (const std::int64_t step : {kSecond, kSecond / 20, -kSecond / 20}) {
    ClockMap map;
    SkewedClock clock{2e-5, 0};
    worst_error_ns(map, clock, 0, 10 * kSecond, kSecond / 100, 0);
    clock.offset_ns += step;
    const std::int64_t worst =
        worst_error_ns(map, clock, 10 * kSecond, 20 * kSecond, kSecond / 100, 2 * kSecond);
    EXPECT_EQ(map.steps(), 1u) << "step " << step;
    EXPECT_LT(worst, 1'000'000) << "step " << step;
  }
}

TEST(ClockMap, APauseOfMinutesIsNoStep) {
  ClockMap map;
  const SkewedClock clock{4e-5, 0};
  worst_error_ns(map, clock, 0, 30 * kSecond, kSecond / 100, 0);
  worst_error_ns(map, clock, 330 * kSecond, 331 * kSecond, kSecond / 100, 0);
  EXPECT_EQ(map.steps(), 0u);
}

}  // namespace
}  // namespace striper
