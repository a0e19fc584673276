// SPDX-License-Identifier: Apache-2.0
#include "stream/files/read_number.hpp"

#include <charconv>
#include <cmath>
#include <limits>

namespace striper::detail {
namespace {

// Three years: no source without a clock has run as long, and no clock is of 1973.
constexpr double kSince1970_s = 1e8;

template <typename Number>
bool read_whole(std::string_view text, Number& number) noexcept {
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  return error == std::errc() && end == last;
}

}  // namespace

bool read_number(std::string_view text, double& number) noexcept {
  return read_whole(text, number);
}
bool read_number(std::string_view text, float& number) noexcept { return read_whole(text, number); }
bool read_number(std::string_view text, std::uint64_t& number) noexcept {
  return read_whole(text, number);
}
bool read_number(std::string_view text, int& number) noexcept { return read_whole(text, number); }

bool read_into(std::string_view text, const ScanColumn& column, Return& out) noexcept {
  const auto read = [&](auto member) {
    auto& value = out.*member;
    value = std::numeric_limits<std::remove_reference_t<decltype(value)>>::quiet_NaN();
    return text.empty() || read_number(text, value);
  };
  return std::visit(read, column.member);
}

// Nanoseconds since 1970 are more than a double holds exactly, so that the seconds are those of the
// nearest doubles: one of these gave the text.
FrameTime time_of_seconds(double seconds) noexcept {
  FrameTime time;
  if (!(std::abs(seconds) < 9e9)) return time;  // More than 64 bits of nanoseconds hold.
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

}  // namespace striper::detail
