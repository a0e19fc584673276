// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace striper {

/// When a frame was exposed: the midpoint of its exposure on CLOCK_MONOTONIC, with the offset to
/// UTC.
///
/// A source without a clock (image files of a directory, the simulator) counts from its first frame
/// and has no offset.
struct FrameTime {
  std::int64_t monotonic_ns = 0;
  std::optional<std::int64_t> utc_offset_ns;  ///< UTC since 1970 = monotonic_ns + *utc_offset_ns.

  /// Seconds since 1970, or since the first frame where the source has no clock.
  double seconds() const noexcept {
    return static_cast<double>(monotonic_ns + utc_offset_ns.value_or(0)) / 1e9;
  }

  /// The same on std::chrono's clocks: steady_clock is CLOCK_MONOTONIC.
  std::chrono::steady_clock::time_point steady() const noexcept {
    return std::chrono::steady_clock::time_point(
        std::chrono::duration_cast<std::chrono::steady_clock::duration>(
            std::chrono::nanoseconds(monotonic_ns)));
  }

  /// The time of day; empty where the source has no clock.
  std::optional<std::chrono::system_clock::time_point> utc() const noexcept {
    if (!utc_offset_ns) return std::nullopt;
    return std::chrono::system_clock::time_point(
        std::chrono::duration_cast<std::chrono::system_clock::duration>(
            std::chrono::nanoseconds(monotonic_ns + *utc_offset_ns)));
  }

  /// Half of what 64 bits of nanoseconds hold, so that they hold the difference of any two: the
  /// year 2115. What is beyond is in other units.
  static constexpr double kMostSeconds = 4.6e9;

  /// The time whose `seconds` these are, to the last bit where there is one: what was written from
  /// a time reads back to the same text. From 1e8 s on (1973) it is since 1970, before that since
  /// the first frame. Zero beyond `kMostSeconds` to either side.
  static FrameTime at_seconds(double seconds) noexcept;
};

}  // namespace striper
