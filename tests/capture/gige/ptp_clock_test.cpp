// SPDX-License-Identifier: Apache-2.0
// Proves that the two countings of time that PTP masters send become UTC, and that a time without a
// meaning does not.
#include "gige/clock/ptp_clock.hpp"

#include <gtest/gtest.h>

namespace striper::detail {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kNow = 1'800'000'000 * kSecond;

TEST(PtpClock, TaiAndUtcBecomeUtcToTheNanosecond) {
  for (const std::int64_t host_is_off : {-kSecond / 3, std::int64_t{0}, kSecond / 3}) {
    EXPECT_EQ(utc_of_ptp(kNow + 37 * kSecond, kNow + host_is_off), kNow);
    EXPECT_EQ(utc_of_ptp(kNow, kNow + host_is_off), kNow);
  }
}

TEST(PtpClock, ATimeOfAnotherEpochIsNone) {
  EXPECT_EQ(utc_of_ptp(3600 * kSecond, kNow), std::nullopt);
  EXPECT_EQ(utc_of_ptp(kNow + 36 * kSecond, kNow), std::nullopt);
  EXPECT_EQ(utc_of_ptp(kNow + kSecond, kNow), std::nullopt);
}

TEST(PtpClock, OnlyAFollowerOrTheMasterHasTheTime) {
  EXPECT_TRUE(is_ptp_time("Slave"));
  EXPECT_TRUE(is_ptp_time("Master"));
  for (const char* status : {"", "Listening", "Uncalibrated", "Faulty", "Disabled"}) {
    EXPECT_FALSE(is_ptp_time(status)) << status;
  }
}

}  // namespace
}  // namespace striper::detail
