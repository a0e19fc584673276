// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include <striper/can/can_listener.hpp>
#include <striper/guidance/guidance_csv.hpp>
#include <striper/motion/odometer_csv.hpp>

namespace striper {

/// What a truck says over CAN.
using TruckWord = std::variant<OdometerReading, TruckState>;

/// Where in a frame of somebody else's a counter stands, as a DBC file has it: `START|SIZE@ORDER`.
struct CanSignal {
  int start = 0;
  int size = 32;
  bool is_big_endian = false;  ///< `start` is then its highest bit, by DBC's sawtooth numbering.

  /// @throws Error{kBadValue} where it does not fit a frame.
  void validate() const;
  /// The bits as a whole number. @return nothing where the frame is too short.
  std::optional<std::uint64_t> read(const CanFrame& frame) const noexcept;
};

/// Reads the frames `TRUCK_ODOMETER` and `TRUCK_STATE` of data/can/guidance.dbc, or a counter
/// anywhere in a frame of a truck's own. No allocation. Thread-safe.
class TruckFrames {
 public:
  static constexpr std::uint32_t kFirstId = 0x330;

  /// @param first_id of the two. @param counter the odometer alone, of a frame with that
  /// identifier.
  explicit TruckFrames(std::uint32_t first_id = kFirstId, std::optional<CanSignal> counter = {});
  /// By an address: `can:can0?id=816`, or `can:can0?id=0x18FEE000&start=7&size=32&order=big`.
  /// Takes those keys. @throws Error{kUsage, kBadValue}.
  static TruckFrames of(CanUri& uri);

  std::vector<std::uint32_t> ids() const;
  /// Of the counter; what is beyond wraps.
  int counter_bits() const noexcept { return counter_ ? counter_->size : 32; }
  /// @return nothing where the frame is another one, too short, or says that it does not know.
  std::optional<TruckWord> read(const HeardFrame& heard) const noexcept;

 private:
  std::uint32_t first_id_;
  std::optional<CanSignal> counter_;
};

}  // namespace striper
