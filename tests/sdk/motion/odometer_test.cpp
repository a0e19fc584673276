// SPDX-License-Identifier: Apache-2.0
// Proves, with a wheel whose true path is known, that distance is exact to the count through wraps,
// missed readings, reversal, stalls and faults of the counter; that between counts it is
// interpolated; and that its error bars are those that happen. Does not prove what a wheel that
// slips does.
#include <cmath>
#include <functional>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/motion/odometer.hpp>

#include "support/allocation_counter.hpp"
#include "support/error_of.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;

constexpr double kMphInMetresPerSecond = 0.44704;

OdometerOptions wheel(double counts_per_m, int bits) {
  OdometerOptions options;
  options.counts_per_m = counts_per_m;
  options.bits = bits;
  return options;
}

// A counter on a wheel: where it is on the path at a time, and what its counter shows then.
struct Wheel {
  std::function<double(double)> path_m;
  double counts_per_m = 100.0;
  int bits = 32;

  std::int64_t counts(double time_s) const {
    return static_cast<std::int64_t>(std::floor(path_m(time_s) * counts_per_m));
  }
  OdometerReading reading(double time_s) const {
    return {time_s, counts(time_s) & ((std::int64_t{1} << bits) - 1)};
  }
};

// From standing with 2 m/s^2 to 60 mph, then on with that.
double to_sixty_mph(double time_s) {
  const double top = 60.0 * kMphInMetresPerSecond;
  const double until_s = top / 2.0;
  return time_s < until_s ? time_s * time_s : until_s * until_s + top * (time_s - until_s);
}

TEST(Odometer, EightBitsWrapAtSixtyMphWithOneMissedReading) {
  // 134 counts from reading to reading at that speed: more than half a turn of the counter. The
  // missed one makes it 268: more than a whole one.
  const Wheel truck{to_sixty_mph, 100.0, 8};
  Odometer odometer(wheel(100.0, 8));
  constexpr double kPeriod_s = 0.05;
  for (int i = 0; i <= 600; ++i) {
    if (i == 500) continue;
    const OdometerVerdict verdict = odometer.update(truck.reading(i * kPeriod_s));
    EXPECT_EQ(verdict, i == 501 ? OdometerVerdict::kMissed : OdometerVerdict::kTaken) << i;
    ASSERT_EQ(odometer.total_counts(), truck.counts(i * kPeriod_s)) << i;
  }
  const std::int64_t counts = truck.counts(30.0);
  EXPECT_EQ(counts, 62481);
  EXPECT_EQ(odometer.latest().distance_m, static_cast<double>(counts) / 100.0);
  EXPECT_NEAR(odometer.latest().speed_m_s, 26.82, 0.3);
  EXPECT_EQ(odometer.statistics().missed, 1U);
  EXPECT_EQ(odometer.statistics().ambiguous, 0U);
  EXPECT_EQ(odometer.direction(), 1);
}

TEST(Odometer, EveryWidthWrapsExactlyWithReadingsMissedAtRandom) {
  for (const int bits : {8, 16, 32}) {
    const Wheel truck{[](double t) { return 1e9 + to_sixty_mph(t) * std::cos(0.01 * t); }, 90.0,
                      bits};
    Odometer odometer(wheel(90.0, bits));
    bool has_missed = false;
    double time_s = 0.0;
    odometer.update(truck.reading(time_s));
    const std::int64_t first = truck.counts(0.0);
    for (int i = 1; i < 3000; ++i) {
      time_s = 0.04 * i + testing::uniform(-0.002, 0.002);
      has_missed = !has_missed && testing::uniform(0, 1) < 0.2;  // Never two in a row.
      if (has_missed) continue;
      odometer.update(truck.reading(time_s));
      ASSERT_EQ(odometer.total_counts(), truck.counts(time_s) - first) << bits << " bits, " << i;
    }
    EXPECT_EQ(odometer.statistics().implausible, 0U);
    EXPECT_GT(odometer.statistics().missed, 100U);
  }
}

TEST(Odometer, ReversalIsExact) {
  // 30 m forwards and 12 m back again, slowing down on the way: a cosine between the two.
  const auto path_m = [](double t) {
    const double pi = std::numbers::pi;
    if (t < 10.0) return 15.0 * (1.0 - std::cos(pi * t / 10.0));
    return 30.0 - 6.0 * (1.0 - std::cos(pi * std::min(1.0, (t - 10.0) / 8.0)));
  };
  const Wheel cart{path_m, 250.0, 8};
  Odometer odometer(wheel(250.0, 8));
  double most_m = 0.0;
  for (int i = 0; i <= 400; ++i) {
    odometer.update(cart.reading(0.05 * i));
    ASSERT_EQ(odometer.total_counts(), cart.counts(0.05 * i)) << i;
    most_m = std::max(most_m, odometer.latest().distance_m);
    if (i == 100) {
      EXPECT_EQ(odometer.direction(), 1);
    }
    if (i == 280) {
      EXPECT_EQ(odometer.direction(), -1);
      EXPECT_LT(odometer.latest().speed_m_s, -2.0);
    }
  }
  EXPECT_EQ(most_m, 30.0);
  EXPECT_EQ(odometer.latest().distance_m, 18.0);
  EXPECT_EQ(odometer.direction(), 0);
}

TEST(Odometer, CounterThatCountsDownGoesForwards) {
  Odometer odometer(wheel(-50.0, 16));
  for (int i = 0; i <= 40; ++i) odometer.update({0.1 * i, (10 - 5 * i) & 0xffff});
  EXPECT_EQ(odometer.latest().distance_m, 4.0);
  EXPECT_NEAR(odometer.latest().speed_m_s, 1.0, 1e-9);
  EXPECT_EQ(odometer.direction(), 1);
  EXPECT_GT(odometer.latest().sigma_distance_m, 0.0);
}

TEST(Odometer, StallIsStandingFromTheLastCountOn) {
  // 2 m/s for 5 s, 10 s of standing, 2 m/s again: exactly 20 m.
  const auto path_m = [](double t) { return 2.0 * (std::min(t, 5.0) + std::max(0.0, t - 15.0)); };
  const Wheel cart{path_m, 64.0, 8};
  Odometer odometer(wheel(64.0, 8));
  for (int i = 0; i <= 400; ++i) {
    odometer.update(cart.reading(0.05 * i));
    if (i == 250) {
      EXPECT_TRUE(odometer.is_stalled());
      EXPECT_EQ(odometer.direction(), 0);
      EXPECT_EQ(odometer.latest().speed_m_s, 0.0);
      EXPECT_LT(odometer.latest().sigma_speed_m_s, 0.02);
      EXPECT_EQ(odometer.latest().distance_m, 10.0);
    }
  }
  EXPECT_FALSE(odometer.is_stalled());
  EXPECT_EQ(odometer.latest().distance_m, 20.0);
  for (const double time_s : {5.1, 7.0, 12.34, 14.9}) {
    EXPECT_EQ(odometer.at(time_s).distance_m, 10.0) << time_s;
    EXPECT_EQ(odometer.at(time_s).speed_m_s, 0.0) << time_s;
  }
  EXPECT_NEAR(odometer.at(2.5).distance_m, 5.0, 1.0 / 64.0);
  EXPECT_NEAR(odometer.at(17.5).distance_m, 15.0, 1.0 / 64.0);
}

TEST(Odometer, SlowMotionIsInterpolatedBetweenCounts) {
  // A count each 0.28 s, read each 0.01 s: a staircase would be off by up to a whole count.
  const double speed_m_s = 1.0 / (64.0 * 0.28);
  const Wheel cart{[=](double t) { return speed_m_s * t; }, 64.0, 16};
  Odometer odometer(wheel(64.0, 16));
  double worst_counts = 0.0;
  for (int i = 0; i <= 2000; ++i) odometer.update(cart.reading(0.01 * i));
  for (double t = 11.0; t < 19.0; t += 0.0037) {
    const Motion motion = odometer.at(t);
    worst_counts = std::max(worst_counts, 64.0 * std::abs(motion.distance_m - cart.path_m(t)));
    EXPECT_NEAR(motion.speed_m_s, speed_m_s, 0.05 * speed_m_s);
  }
  EXPECT_LT(worst_counts, 0.01 / 0.28 + 1e-9);  // Only when within a reading is not known.
}

TEST(Odometer, GlitchIsNotTakenAndAResetCounterGoesOnFromThere) {
  const Wheel truck{to_sixty_mph, 100.0, 32};
  Odometer odometer(wheel(100.0, 32));
  const auto verdict_at = [&](int i, std::int64_t counts) {
    return odometer.update({0.05 * i, counts});
  };
  for (int i = 0; i < 200; ++i) verdict_at(i, truck.counts(0.05 * i));
  EXPECT_EQ(verdict_at(200, 123456789), OdometerVerdict::kImplausible);
  EXPECT_EQ(verdict_at(201, truck.counts(0.05 * 201)), OdometerVerdict::kTaken);
  EXPECT_EQ(odometer.total_counts(), truck.counts(0.05 * 201));

  const double sigma_m = odometer.latest().sigma_distance_m;
  const std::int64_t zero = truck.counts(0.05 * 202);
  EXPECT_EQ(verdict_at(202, 0), OdometerVerdict::kImplausible);
  EXPECT_EQ(verdict_at(203, truck.counts(0.05 * 203) - zero), OdometerVerdict::kImplausible);
  EXPECT_EQ(verdict_at(204, truck.counts(0.05 * 204) - zero), OdometerVerdict::kRestarted);
  for (int i = 205; i < 300; ++i) {
    EXPECT_EQ(verdict_at(i, truck.counts(0.05 * i) - zero), OdometerVerdict::kTaken) << i;
  }
  const std::int64_t lost = truck.counts(0.05 * 204) - truck.counts(0.05 * 201);
  EXPECT_EQ(odometer.total_counts(), truck.counts(0.05 * 299) - lost);
  // What was lost is within the error that is told.
  EXPECT_LT(0.01 * static_cast<double>(lost), 2.0 * odometer.latest().sigma_distance_m);
  EXPECT_GT(odometer.latest().sigma_distance_m, 100.0 * sigma_m);
}

TEST(Odometer, TooLongAGapIsAmbiguousAndItsErrorSaysSo) {
  const Wheel truck{to_sixty_mph, 100.0, 8};
  Odometer odometer(wheel(100.0, 8));
  for (int i = 0; i <= 300; ++i) odometer.update(truck.reading(0.05 * i));
  EXPECT_LT(odometer.latest().sigma_distance_m, 0.01);
  EXPECT_EQ(odometer.update(truck.reading(15.5)), OdometerVerdict::kAmbiguous);
  EXPECT_GT(odometer.latest().sigma_distance_m, 2.56 / std::sqrt(12.0));
  EXPECT_EQ(odometer.statistics().ambiguous, 1U);
}

TEST(Odometer, YawIsTheIntegralOfItsRate) {
  Odometer odometer(wheel(100.0, 32));
  OdometerOptions options = wheel(100.0, 32);
  options.yaw_rate_sigma_rad_s = 0.01;
  Odometer turning(options);
  for (int i = 0; i <= 100; ++i) {
    odometer.update({0.1 * i, 10 * i});
    turning.update({0.1 * i, 10 * i, 0.02 * i});
  }
  EXPECT_TRUE(std::isnan(odometer.latest().yaw_rad));
  EXPECT_NEAR(turning.latest().yaw_rad, 10.0, 1e-9);
  EXPECT_NEAR(turning.at(5.05).yaw_rad, 0.1 * 5.05 * 5.05, 1e-3);
  EXPECT_NEAR(turning.at(5.05).yaw_rate_rad_s, 1.01, 1e-9);
  EXPECT_NEAR(turning.latest().sigma_yaw_rad, 0.01 * 0.1 * std::sqrt(100.0), 1e-9);
}

TEST(Odometer, ErrorBarsAreThoseThatHappen) {
  constexpr int kTrials = 2000;
  double distance_pulls = 0.0;
  double speed_pulls = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const double start_m = testing::uniform(0, 1);
    const double speed_m_s = testing::uniform(3, 20);
    const Wheel truck{[=](double t) { return start_m + speed_m_s * t; }, 10.0, 16};
    Odometer odometer(wheel(10.0, 16));
    for (int i = 0; i <= 20; ++i) odometer.update(truck.reading(0.2 * i));
    const Motion motion = odometer.latest();
    distance_pulls += std::pow((motion.distance_m - 4.0 * speed_m_s) / motion.sigma_distance_m, 2);
    speed_pulls += std::pow((motion.speed_m_s - speed_m_s) / motion.sigma_speed_m_s, 2);
  }
  EXPECT_NEAR(distance_pulls / kTrials, 1.0, 0.1);
  EXPECT_NEAR(speed_pulls / kTrials, 1.0, 0.1);
}

TEST(Odometer, IsUnknownWhereItHasNotBeen) {
  OdometerOptions options = wheel(100.0, 32);
  options.history = 8;
  Odometer odometer(options);
  EXPECT_TRUE(std::isnan(odometer.latest().distance_m));
  for (int i = 0; i <= 20; ++i) odometer.update({0.1 * i, 10 * i});
  EXPECT_TRUE(std::isnan(odometer.at(0.5).distance_m));
  EXPECT_NEAR(odometer.at(1.55).distance_m, 1.55, 1e-9);
  EXPECT_NEAR(odometer.at(2.2).distance_m, 2.2, 1e-9);  // On with its speed,
  EXPECT_GT(odometer.at(2.2).sigma_distance_m, odometer.at(2.0).sigma_distance_m);
  EXPECT_TRUE(std::isnan(odometer.at(2.6).distance_m));  // but not for long.
  EXPECT_EQ(odometer.update({1.0, 200}), OdometerVerdict::kOutOfOrder);
  EXPECT_EQ(odometer.update({HUGE_VAL, 200}), OdometerVerdict::kOutOfOrder);
  EXPECT_EQ(odometer.total_counts(), 200);
}

TEST(Odometer, ReadingsCostNoAllocation) {
  Odometer odometer(wheel(100.0, 16));
  const testing::AllocationCounter counter;
  double sum = 0.0;
  for (int i = 0; i < 5000; ++i) {
    odometer.update({0.01 * i, (7 * i) & 0xffff, 0.1});
    sum += odometer.at(0.01 * i - 0.005).distance_m;
  }
  EXPECT_EQ(counter.count(), 0U);
  EXPECT_TRUE(std::isnan(sum));  // The first one is before the first reading.
}

TEST(Odometer, OptionsAreChecked) {
  const auto message = [](auto change) {
    OdometerOptions options = wheel(100.0, 32);
    change(options);
    const Error error = testing::error_of([&] { Odometer{options}; });
    EXPECT_EQ(error.kind(), ErrorKind::kBadValue);
    return std::string(error.what());
  };
  EXPECT_THAT(message([](auto& o) { o.counts_per_m = 0.0; }), HasSubstr("counts_per_m is 0"));
  EXPECT_THAT(message([](auto& o) { o.counts_per_m = NAN; }), HasSubstr("counts_per_m is nan"));
  EXPECT_THAT(message([](auto& o) { o.bits = 24; }), HasSubstr("bits is 24; expected 8, 16 or 32"));
  EXPECT_THAT(message([](auto& o) { o.stall_s = 0.0; }), HasSubstr("stall_s is 0"));
  EXPECT_THAT(message([](auto& o) { o.history = 2; }), HasSubstr("history is 2"));
}

}  // namespace
}  // namespace striper
