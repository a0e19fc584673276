// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ctime>

namespace striper::detail {

inline std::int64_t read_clock_ns(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

inline std::int64_t monotonic_now_ns() noexcept { return read_clock_ns(CLOCK_MONOTONIC); }

/// UTC minus CLOCK_MONOTONIC, now: follows whoever sets the system's clock.
inline std::int64_t utc_offset_now_ns() noexcept {
  const std::int64_t before_ns = monotonic_now_ns();
  const std::int64_t utc_ns = read_clock_ns(CLOCK_REALTIME);
  const std::int64_t after_ns = monotonic_now_ns();
  return utc_ns - (before_ns + (after_ns - before_ns) / 2);
}

}  // namespace striper::detail
