// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include <striper/can/guidance_frames.hpp>

namespace striper {
namespace {

// Steps of the scales, as data/can/guidance.dbc has them.
constexpr double kLateralStep_m = 1e-4;
constexpr double kVoltStep = 1e-3;
constexpr double kLatencyStep_s = 1e-4;
constexpr double kWayStep_m = 1e-3;

enum Kind : std::uint32_t { kLateral, kGuns, kFault, kWay };

// The nearest step on the scale of an integer whose value `unknown` is kept for what is no number.
template <typename Integer>
Integer steps(double value, double step, Integer unknown) noexcept {
  if (std::isnan(value)) return unknown;
  constexpr auto kLeast = static_cast<double>(std::numeric_limits<Integer>::min());
  constexpr auto kMost = static_cast<double>(std::numeric_limits<Integer>::max());
  const double least = unknown == std::numeric_limits<Integer>::min() ? kLeast + 1.0 : kLeast;
  const double most = unknown == std::numeric_limits<Integer>::max() ? kMost - 1.0 : kMost;
  return static_cast<Integer>(std::llround(std::clamp(value / step, least, most)));
}

template <typename Integer>
void put(CanFrame& frame, std::size_t at, Integer value) noexcept {
  const auto bits = static_cast<std::uint64_t>(value);
  for (std::size_t i = 0; i < sizeof(Integer); ++i) {
    frame.data[at + i] = static_cast<std::uint8_t>(bits >> 8 * i);
  }
}

template <typename Integer>
constexpr Integer kLowest = std::numeric_limits<Integer>::min();
template <typename Integer>
constexpr Integer kHighest = std::numeric_limits<Integer>::max();

}  // namespace

// The count is the last byte.
CanFrame GuidanceFrames::counted(std::uint32_t kind, std::uint8_t size) noexcept {
  CanFrame frame{first_id_ + kind, size, {}};
  frame.data[size - 1U] = counters_[kind]++;
  return frame;
}

CanFrame GuidanceFrames::lateral(const LateralLine& line) noexcept {
  CanFrame frame = counted(kLateral, 8);
  put(frame, 0, steps(line.lateral_m, kLateralStep_m, kLowest<std::int16_t>));
  put(frame, 2, steps(line.sigma_m, kLateralStep_m, kHighest<std::uint16_t>));
  put(frame, 4, steps(line.volts, kVoltStep, kLowest<std::int16_t>));
  const auto beams = static_cast<unsigned>(std::clamp(line.beams, 0, 15));
  frame.data[6] = static_cast<std::uint8_t>(static_cast<unsigned>(line.state) | beams << 4);
  return frame;
}

CanFrame GuidanceFrames::guns(std::uint8_t guns, bool is_laser_off) noexcept {
  CanFrame frame = counted(kGuns, 3);
  frame.data[0] = guns;
  frame.data[1] = is_laser_off ? 1 : 0;
  return frame;
}

CanFrame GuidanceFrames::fault(const FaultLine& line) noexcept {
  CanFrame frame = counted(kFault, 5);
  frame.data[0] = static_cast<std::uint8_t>(line.code);
  frame.data[1] = static_cast<std::uint8_t>(line.action);
  put(frame, 2, steps(line.latency_s, kLatencyStep_s, kHighest<std::uint16_t>));
  return frame;
}

CanFrame GuidanceFrames::way(const LateralLine& line) const noexcept {
  CanFrame frame{first_id_ + kWay, 8, {}};
  put(frame, 0, static_cast<std::uint32_t>(line.odometer_counts));  // Its lower 32 bits.
  put(frame, 4, steps(line.distance_m, kWayStep_m, kLowest<std::int32_t>));
  return frame;
}

}  // namespace striper
