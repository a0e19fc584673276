// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <limits>

#include <striper/motion/odometer_csv.hpp>

namespace striper {
namespace {

constexpr double kAny = std::numeric_limits<double>::max();

constexpr std::array kColumns{
    csv_column<OdometerReading>(
        "time_s",
        [](auto& r) {
          return CsvBetween{r.time_s, -kAny, kAny};
        },
        CsvNeed::kRequired),
    csv_column<OdometerReading>(
        "counts", [](auto& r) -> auto& { return r.counts; }, CsvNeed::kRequired),
    csv_column<OdometerReading>(
        "yaw_rate_rad_s", [](auto& r) -> auto& { return r.yaw_rate_rad_s; }),
};

}  // namespace

std::span<const CsvColumn<OdometerReading>> odometer_columns() { return kColumns; }

CsvReader<OdometerReading> open_odometer_csv(const std::filesystem::path& path) {
  return {CsvInput::open(path), kColumns, "odometer table"};
}

}  // namespace striper
