// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include <striper/core/frame_time.hpp>

namespace striper {
namespace {

// Three years: no source without a clock has run as long, and no clock is of 1973.
constexpr double kSince1970_s = 1e8;

}  // namespace

// Nanoseconds since 1970 are more than a double holds exactly (its steps are 256 ns), so that the
// seconds are those of the nearest doubles: one of these gave the text.
FrameTime FrameTime::at_seconds(double seconds) noexcept {
  FrameTime time;
  if (!(std::abs(seconds) <= kMostSeconds)) return time;
  if (seconds >= kSince1970_s) time.utc_offset_ns = 0;
  const double infinity = std::numeric_limits<double>::infinity();
  const double nearest_ns = std::round(seconds * 1e9);
  for (const double ns :
       {nearest_ns, std::nextafter(nearest_ns, -infinity), std::nextafter(nearest_ns, infinity)}) {
    time.monotonic_ns = std::llround(ns);
    if (time.seconds() == seconds) return time;
  }
  time.monotonic_ns = std::llround(nearest_ns);
  return time;
}

}  // namespace striper
