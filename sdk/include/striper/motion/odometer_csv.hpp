// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <string>

#include <striper/core/csv_table.hpp>

namespace striper {

/// What an odometer says once: a line of `odometer.csv`.
struct OdometerReading {
  double time_s = 0.0;      ///< On the scans' clock.
  std::int64_t counts = 0;  ///< As the counter shows it: it may wrap.
  /// From a gyroscope, counter-clockwise from above; NaN where there is none.
  double yaw_rate_rad_s = std::numeric_limits<double>::quiet_NaN();
};

/// The columns of `odometer.csv`: `time_s,counts,yaw_rate_rad_s`, the last one may be missing or
/// empty.
std::span<const CsvColumn<OdometerReading>> odometer_columns();

/// Reads `odometer.csv` reading by reading. @throws Error as `CsvReader` does.
CsvReader<OdometerReading> open_odometer_csv(const std::filesystem::path& path);

/// Begins to write one. @throws Error as `CsvWriter` does.
inline CsvWriter<OdometerReading> make_odometer_csv(const std::string& path) {
  return {path, odometer_columns()};
}

}  // namespace striper
