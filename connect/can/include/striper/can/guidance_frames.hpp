// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include <striper/can/can_port.hpp>
#include <striper/guidance/guidance_csv.hpp>

namespace striper {

/// Writes what guidance says as CAN frames; `data/can/guidance.dbc` describes them for everybody
/// else.
///
/// Numbers are little-endian and in steps; what does not fit is at the end of the scale, what is
/// not known at a value of its own (`unknown` in the file). Each kind of frame counts its own, so
/// that a receiver sees what it missed and whether anybody still sends. No allocation. Not
/// thread-safe.
class GuidanceFrames {
 public:
  static constexpr std::uint32_t kFirstId = 0x320;
  static constexpr std::uint32_t kIds = 4;
  static constexpr std::size_t kMostGuns = 8;

  explicit GuidanceFrames(std::uint32_t first_id = kFirstId) noexcept : first_id_(first_id) {}

  CanFrame lateral(const LateralLine& line) noexcept;
  /// @param guns bit i is gun i's signal.
  CanFrame guns(std::uint8_t guns, bool is_laser_off) noexcept;
  CanFrame fault(const FaultLine& line) noexcept;
  CanFrame way(const LateralLine& line) const noexcept;  ///< Of the same scan.

 private:
  CanFrame counted(std::uint32_t kind, std::uint8_t size) noexcept;

  std::uint32_t first_id_;
  std::array<std::uint8_t, kIds> counters_{};
};

}  // namespace striper
