// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace striper {

/// Maps the clock of a device to CLOCK_MONOTONIC by a running fit of offset and rate.
///
/// Each observation pairs a device time with a host time at or after it: what is in between
/// (transport, scheduling) is never negative and sometimes long. So the map is not a mean but the
/// line *under* the observations, with the rate that keeps it closest to them (Moon, Skelly &
/// Towsley 1999: the edge of the lower convex hull below the mean abscissa); one late packet, or
/// a thousand, do not move it. The window keeps the earliest observation of each quarter second,
/// 64 seconds in all.
///
/// A device clock that steps or restarts is noticed: at once where the new times run backwards or
/// are impossibly early, after a second where they are late. The map then starts anew.
///
/// Cost: at most one pass over 256 points per observation; no allocation. Not thread-safe.
class ClockMap {
 public:
  /// @param device_ns device time of an event, nanoseconds.
  /// @param host_ns when the host knew of it, nanoseconds of CLOCK_MONOTONIC.
  void observe(std::int64_t device_ns, std::int64_t host_ns) noexcept;

  bool is_ready() const noexcept { return count_ > 0; }

  /// Host time of a device time. Precondition: `is_ready()`.
  std::int64_t to_host(std::int64_t device_ns) const noexcept;

  /// Host seconds per device second; 1 until two seconds have been seen.
  double rate() const noexcept { return 1.0 + skew_; }

  /// How often the device's clock was found to have stepped.
  std::uint64_t steps() const noexcept { return steps_; }

  /// Forgets everything but `steps()`: for a device that was opened again.
  void reset() noexcept;

 private:
  // An observation as time since the first one, and host minus device beyond the first one's.
  struct Point {
    double device_s = 0.0;
    double delay_s = 0.0;
  };
  static constexpr std::size_t kPoints = 256;

  void restart(std::int64_t device_ns, std::int64_t host_ns) noexcept;
  bool has_stepped(const Point& point, std::int64_t device_ns, std::int64_t host_ns) noexcept;
  void keep(const Point& point) noexcept;
  void fit() noexcept;
  const Point& at(std::size_t i) const noexcept { return points_[(first_ + i) % kPoints]; }

  std::array<Point, kPoints> points_{};
  std::array<std::size_t, kPoints> hull_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;

  std::int64_t device_origin_ns_ = 0;
  std::int64_t offset_origin_ns_ = 0;
  std::int64_t last_device_ns_ = 0;
  double offset_s_ = 0.0;
  double skew_ = 0.0;

  // A run of observations that are all later than a step could be explained by delay.
  std::int64_t late_since_ns_ = 0;
  std::int64_t late_device_ns_ = 0;
  std::int64_t late_host_ns_ = 0;
  bool is_late_ = false;
  std::uint64_t steps_ = 0;
};

}  // namespace striper
