// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

namespace striper {

/// When a picture was exposed: the midpoint of its exposure on CLOCK_MONOTONIC, with the offset to
/// UTC.
///
/// A source without a clock (pictures of a directory, the simulator) counts from its first frame
/// and has no offset.
struct FrameTime {
  std::int64_t monotonic_ns = 0;
  std::optional<std::int64_t> utc_offset_ns;  ///< UTC since 1970 = monotonic_ns + *utc_offset_ns.

  /// Seconds since 1970, or since the first frame where the source has no clock.
  double seconds() const noexcept {
    return static_cast<double>(monotonic_ns + utc_offset_ns.value_or(0)) / 1e9;
  }
};

}  // namespace striper
