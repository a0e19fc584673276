// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace striper::detail {

/// Turns the block ids of a GigE Vision stream into one sequence without wraps, that goes on when
/// the camera was lost and opened again.
///
/// Block ids are 16 bits from 1 to 65535 and then 1 again, never 0 (GigE Vision 1.2, 23.3); devices
/// with extended ids count to 2^64; some count from 0 or never restart: all are understood.
class FrameNumbers {
 public:
  struct Number {
    std::uint64_t sequence = 0;
    std::uint64_t since_start = 0;  ///< 0 for the first exposure after acquisition start.
    std::uint64_t missing = 0;      ///< Pictures between the last one and this.
  };

  /// @param cadence_length after the camera was opened again the sequence goes on with a multiple
  /// of this, since the cadence does too.
  explicit FrameNumbers(std::uint64_t cadence_length = 1) noexcept
      : cadence_length_(cadence_length) {}

  /// The acquisition was started again. @param lost how many pictures that took, about.
  void restart(std::uint64_t lost) noexcept {
    if (has_any_) {
      const std::uint64_t at_least = next_sequence_ + lost;
      base_ = (at_least + cadence_length_ - 1) / cadence_length_ * cadence_length_;
    }
    has_start_ = false;
  }

  Number next(std::uint64_t block_id) noexcept {
    if (!has_start_) {
      // The first ones may have been lost; a number far off 1 is of a device that never restarts.
      constexpr std::uint64_t kMayBeLost = 8;
      since_start_ = block_id >= 1 && block_id <= kMayBeLost ? block_id - 1 : 0;
      has_start_ = true;
    } else {
      since_start_ += step_to(block_id);
    }
    last_id_ = block_id;
    Number number;
    number.since_start = since_start_;
    number.sequence = base_ + since_start_;
    number.missing = number.sequence > next_sequence_ ? number.sequence - next_sequence_ : 0;
    next_sequence_ = number.sequence + 1;
    has_any_ = true;
    return number;
  }

 private:
  std::uint64_t step_to(std::uint64_t block_id) noexcept {
    if (block_id == 0) counts_from_zero_ = true;
    if (block_id >= last_id_) return block_id - last_id_;
    if (last_id_ > 0xffff) return 1;  // an extended id that runs backwards: a device's fault
    const std::uint64_t period = counts_from_zero_ ? 0x10000 : 0xffff;
    return block_id + period - last_id_;
  }

  std::uint64_t cadence_length_;
  std::uint64_t base_ = 0;
  std::uint64_t since_start_ = 0;
  std::uint64_t last_id_ = 0;
  std::uint64_t next_sequence_ = 0;
  bool has_start_ = false;
  bool has_any_ = false;
  bool counts_from_zero_ = false;
};

}  // namespace striper::detail
