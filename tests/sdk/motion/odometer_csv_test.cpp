// SPDX-License-Identifier: Apache-2.0
// Proves that odometer.csv reads back as it was written, also without yaw rates, and that a line
// that is wrong is refused or, cut off, left out.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/motion/odometer_csv.hpp>

#include "support/error_of.hpp"
#include "support/random.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;
using testing::ScratchDirectory;

std::vector<OdometerReading> read(const std::filesystem::path& path) {
  auto table = open_odometer_csv(path);
  std::vector<OdometerReading> readings;
  for (OdometerReading reading; table.next(reading); reading = {}) readings.push_back(reading);
  return readings;
}

TEST(OdometerCsv, ReadsBackWhatWasWritten) {
  const ScratchDirectory scratch;
  std::vector<OdometerReading> readings;
  auto table = make_odometer_csv(scratch / "odometer.csv");
  for (int i = 0; i < 500; ++i) {
    OdometerReading reading{1.7e9 + testing::uniform(0, 1e3), i * 3'000'000'000'000'000 - 7};
    if (i % 3 != 0) reading.yaw_rate_rad_s = testing::uniform(-1, 1);
    table.add(readings.emplace_back(reading));
  }
  table.close();
  const auto again = read(scratch / "odometer.csv");
  ASSERT_EQ(again.size(), readings.size());
  for (std::size_t i = 0; i < again.size(); ++i) {
    EXPECT_EQ(again[i].time_s, readings[i].time_s);
    EXPECT_EQ(again[i].counts, readings[i].counts);
    EXPECT_EQ(std::isnan(again[i].yaw_rate_rad_s), i % 3 == 0);
    if (i % 3 != 0) {
      EXPECT_EQ(again[i].yaw_rate_rad_s, readings[i].yaw_rate_rad_s);
    }
  }
}

TEST(OdometerCsv, YawRateMayBeMissingAndAWrongLineIsNamed) {
  const ScratchDirectory scratch;
  const auto path = scratch / "odometer.csv";
  testing::write_bytes(path, "counts,time_s\n5,1.5\n6,1.75\n");
  ASSERT_EQ(read(path).size(), 2U);
  EXPECT_EQ(read(path)[1].counts, 6);
  testing::write_bytes(path, "time_s,counts,yaw_rate_rad_s\n1,5,\n2,five,\n");
  EXPECT_THAT(testing::error_of([&] { read(path); }).what(),
              HasSubstr("line 3: column 'counts' cannot be 'five' - expected a whole number"));
  testing::write_bytes(path, "time_s,counts\n1,5\n2,12");
  EXPECT_EQ(read(path).size(), 1U);
  testing::write_bytes(path, "time_s,yaw_rate_rad_s\n");
  EXPECT_THAT(testing::error_of([&] { read(path); }).what(),
              HasSubstr("no column 'counts': it is no odometer table"));
}

}  // namespace
}  // namespace striper
