// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <striper/motion/odometer.hpp>
#include <striper/scan/polar_scan.hpp>
#include <striper/stream/sink_uri.hpp>

namespace striper::detail {

/// How far the sensor has come, straight on, when a scan was made: nowhere, by a constant speed
/// since the first scan, or as an odometer says. Scans come in the order of their times.
class ScanMotion {
 public:
  static constexpr const char* kKeys = "speed, odometer, counts_per_m, bits";

  /// Takes the keys of a sink's address. @throws Error{kUsage} where they do not go together, and
  /// as `open_odometer_csv` does.
  static ScanMotion take(SinkUri& uri);

  /// NaN before the odometer's first reading, and where it says nothing any more.
  double distance_m(const PolarScan& scan);

 private:
  struct Wheel {
    CsvReader<OdometerReading> readings;
    Odometer odometer;
    double read_until_s = 0.0;
    bool has_more = true;
  };

  double speed_m_s_ = 0.0;
  std::optional<double> first_s_;
  std::optional<Wheel> wheel_;
};

}  // namespace striper::detail
