// SPDX-License-Identifier: Apache-2.0
#include "stream/sinks/scan_motion.hpp"

#include <limits>

#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::detail {
namespace {

constexpr double kFastest_m_s = 1000.0;  // Of anything on a road or a rail: three times sound's.
constexpr double kMostCountsPerMetre = 1e9;

}  // namespace

ScanMotion ScanMotion::take(SinkUri& uri) {
  ScanMotion motion;
  const auto speed = uri.take_number("speed", -kFastest_m_s, kFastest_m_s);
  const auto file = uri.take("odometer");
  const auto counts = uri.take_number("counts_per_m", -kMostCountsPerMetre, kMostCountsPerMetre);
  const auto bits = uri.take_integer("bits", 8, 32);
  if (file.has_value() != counts.has_value() || (speed && file) || (bits && !file)) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("sink '{}': the sensor moves by speed=M_PER_S, or by odometer=FILE with "
                    "counts_per_m=K (and bits=8, 16 or 32)",
                    uri.text()));
  }
  motion.speed_m_s_ = speed.value_or(0.0);
  if (!file) return motion;
  OdometerOptions options;
  options.counts_per_m = *counts;
  options.bits = static_cast<int>(bits.value_or(options.bits));
  motion.wheel_.emplace(Wheel{open_odometer_csv(*file), Odometer(options)});
  motion.wheel_->read_until_s = -std::numeric_limits<double>::infinity();
  return motion;
}

double ScanMotion::distance_m(const PolarScan& scan) {
  const double time_s = scan.time.seconds();
  if (!wheel_) {
    if (!first_s_) first_s_ = time_s;
    return speed_m_s_ * (time_s - *first_s_);
  }
  // As far as the odometer has to know what came next, and no further: it remembers so much.
  OdometerReading reading;
  while (wheel_->has_more && wheel_->read_until_s <= time_s) {
    wheel_->has_more = wheel_->readings.next(reading);
    if (!wheel_->has_more) break;
    wheel_->odometer.update(reading);
    wheel_->read_until_s = reading.time_s;
  }
  return wheel_->odometer.at(time_s).distance_m;
}

}  // namespace striper::detail
