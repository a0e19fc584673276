// SPDX-License-Identifier: Apache-2.0
#include "guide/live/odometer_lines.hpp"

#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>
#include <system_error>
#include <utility>

namespace striper::program {
namespace {

constexpr std::size_t kLongestLine = 80;

std::optional<OdometerReading> reading_of(std::string_view line) {
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  OdometerReading reading;
  const char* const end = line.data() + line.size();
  const auto counts = std::from_chars(line.data(), end, reading.counts);
  if (counts.ec != std::errc()) return {};
  if (counts.ptr == end) return reading;
  if (*counts.ptr != ',') return {};
  const auto yaw = std::from_chars(counts.ptr + 1, end, reading.yaw_rate_rad_s);
  if (yaw.ec != std::errc() || yaw.ptr != end || std::isinf(reading.yaw_rate_rad_s)) return {};
  return reading;
}

}  // namespace

void OdometerLines::begin_anew() {
  line_.clear();
  is_whole_ = false;
}

std::optional<OdometerReading> OdometerLines::take(char byte) {
  if (byte != '\n') {
    if (line_.size() <= kLongestLine) line_ += byte;
    return {};
  }
  const bool is_line = std::exchange(is_whole_, true) && line_.size() <= kLongestLine;
  const auto reading = is_line ? reading_of(line_) : std::nullopt;
  line_.clear();
  return reading;
}

}  // namespace striper::program
