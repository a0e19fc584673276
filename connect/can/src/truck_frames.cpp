// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <striper/can/truck_frames.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

constexpr std::uint32_t kLargestId = 0x1FFFFFFF;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// The signals of guidance.dbc.
constexpr CanSignal kCounts{0, 32, false};
constexpr CanSignal kYawRate{32, 16, false};
constexpr CanSignal kLaser{0, 2, false};
constexpr CanSignal kMirror{8, 16, false};
constexpr double kYawRateStep_rad_s = 1e-4;
constexpr double kMirrorStep_hz = 0.01;
constexpr std::uint64_t kUnknownLaser = 3;
constexpr std::uint64_t kUnknownMirror = 0xFFFF;
constexpr std::int16_t kUnknownYawRate = std::numeric_limits<std::int16_t>::min();

// Where bit `i` of a signal stands, counted from the lowest of the lowest byte. Big-endian (DBC's
// Motorola) signals go down in a byte from their highest bit, then to the top of the next byte.
int place_of(const CanSignal& signal, int i) {
  if (!signal.is_big_endian) return signal.start + i;
  const int from_top = 8 * (signal.start / 8) + 7 - signal.start % 8 + signal.size - 1 - i;
  return 8 * (from_top / 8) + 7 - from_top % 8;
}

// Decimal, or hexadecimal after 0x.
std::uint32_t id_of(std::string_view text) {
  const bool is_hex = text.starts_with("0x") || text.starts_with("0X");
  const std::string_view digits = is_hex ? text.substr(2) : text;
  std::uint32_t id = 0;
  const char* const last = digits.data() + digits.size();
  const auto [end, error] = std::from_chars(digits.data(), last, id, is_hex ? 16 : 10);
  if (error != std::errc() || end != last || id > kLargestId) {
    throw Error(ErrorKind::kUsage,
                fmt::format("id={} - expected an identifier, 0 to 0x{:X}", text, kLargestId));
  }
  return id;
}

OdometerReading reading_of(double time_s, std::uint64_t counts) {
  return {time_s, static_cast<std::int64_t>(counts), kUnknown};
}

std::optional<TruckWord> read_odometer(const HeardFrame& heard) {
  const auto counts = kCounts.read(heard.frame);
  if (!counts) return {};
  OdometerReading reading = reading_of(heard.time_s, *counts);
  if (const auto yaw_rate = kYawRate.read(heard.frame)) {
    const auto steps = static_cast<std::int16_t>(static_cast<std::uint16_t>(*yaw_rate));
    if (steps != kUnknownYawRate) reading.yaw_rate_rad_s = kYawRateStep_rad_s * steps;
  }
  return reading;
}

std::optional<TruckWord> read_state(const HeardFrame& heard) {
  const auto laser = kLaser.read(heard.frame);
  const auto mirror = kMirror.read(heard.frame);
  if (!laser || !mirror) return {};
  TruckState state{heard.time_s};
  // Only what is known to be off is off.
  state.laser = *laser == kUnknownLaser || *laser != 0 ? 1 : 0;
  if (*mirror != kUnknownMirror) state.mirror_hz = kMirrorStep_hz * static_cast<double>(*mirror);
  return state;
}

}  // namespace

void CanSignal::validate() const {
  const bool is_good = size >= 1 && size <= 32 && start >= 0 && start < 64 &&
                       place_of(*this, 0) < 64 && place_of(*this, size - 1) < 64;
  if (is_good) return;
  throw Error(
      ErrorKind::kBadValue,
      fmt::format("start={}&size={} - expected at most 32 bits within a frame's 64", start, size));
}

std::optional<std::uint64_t> CanSignal::read(const CanFrame& frame) const noexcept {
  std::uint64_t value = 0;
  for (int i = 0; i < size; ++i) {
    const auto place = static_cast<unsigned>(place_of(*this, i));
    if (place / 8 >= frame.size) return {};
    const auto bit = static_cast<std::uint64_t>(frame.data[place / 8] >> (place % 8) & 1U);
    value |= bit << static_cast<unsigned>(i);
  }
  return value;
}

TruckFrames::TruckFrames(std::uint32_t first_id, std::optional<CanSignal> counter)
    : first_id_(first_id), counter_(counter) {
  if (counter_) counter_->validate();
}

TruckFrames TruckFrames::of(CanUri& uri) {
  const auto id = uri.take("id");
  const auto start = uri.take_integer("start", 0, 63);
  const auto size = uri.take_integer("size", 1, 32);
  const auto order = uri.take("order");
  if (order && *order != "little" && *order != "big") {
    throw Error(ErrorKind::kUsage, fmt::format("order={} - expected little or big", *order));
  }
  const std::uint32_t first_id = id ? id_of(*id) : kFirstId;
  if (!start && !size && !order) return TruckFrames(first_id);
  const CanSignal counter{static_cast<int>(start.value_or(0)), static_cast<int>(size.value_or(32)),
                          order == "big"};
  return TruckFrames(first_id, counter);
}

std::vector<std::uint32_t> TruckFrames::ids() const {
  if (counter_) return {first_id_};
  return {first_id_, first_id_ + 1};
}

std::optional<TruckWord> TruckFrames::read(const HeardFrame& heard) const noexcept {
  if (counter_) {
    if (heard.frame.id != first_id_) return {};
    const auto counts = counter_->read(heard.frame);
    if (!counts) return {};
    return reading_of(heard.time_s, *counts);
  }
  if (heard.frame.id == first_id_) return read_odometer(heard);
  if (heard.frame.id == first_id_ + 1) return read_state(heard);
  return {};
}

}  // namespace striper
