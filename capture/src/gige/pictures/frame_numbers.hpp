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
    std::uint64_t missing = 0;      ///< Frames between the last one and this.
    bool is_late = false;           ///< Of a frame that was counted, or passed over, already.
  };

  /// @param pattern_length after the camera was opened again the sequence goes on with a multiple
  /// of this, since the pattern does too.
  explicit FrameNumbers(std::uint64_t pattern_length = 1) noexcept
      : pattern_length_(pattern_length) {}

  /// The acquisition was started again. @param lost how many frames that took, about.
  void restart(std::uint64_t lost) noexcept {
    if (has_any_) {
      const std::uint64_t at_least = next_sequence_ + lost;
      base_ = (at_least + pattern_length_ - 1) / pattern_length_ * pattern_length_;
    }
    has_start_ = false;
  }

  Number next(std::uint64_t block_id) noexcept {
    Number number;
    if (!has_start_) {
      // The first ones may have been lost; a number far off 1 is of a device that never restarts.
      constexpr std::uint64_t kMayBeLost = 8;
      newest_ = block_id >= 1 && block_id <= kMayBeLost ? block_id - 1 : 0;
      newest_id_ = block_id;
      has_start_ = true;
      number.since_start = newest_;
    } else {
      const std::int64_t step = step_to(block_id);
      number.since_start = newest_ + static_cast<std::uint64_t>(step);
      if (step <= 0) {
        number.is_late = true;
        number.sequence = base_ + number.since_start;
        return number;
      }
      newest_ = number.since_start;
      newest_id_ = block_id;
    }
    number.sequence = base_ + number.since_start;
    number.missing = number.sequence > next_sequence_ ? number.sequence - next_sequence_ : 0;
    next_sequence_ = number.sequence + 1;
    has_any_ = true;
    return number;
  }

 private:
  /// From the newest block id to this one, whichever way is shorter.
  std::int64_t step_to(std::uint64_t block_id) noexcept {
    if (block_id == 0) counts_from_zero_ = true;
    if (block_id > 0xffff || newest_id_ > 0xffff) {
      return static_cast<std::int64_t>(block_id - newest_id_);
    }
    const std::int64_t period = counts_from_zero_ ? 0x10000 : 0xffff;
    const auto step = static_cast<std::int64_t>(block_id) - static_cast<std::int64_t>(newest_id_);
    if (step > period / 2) return step - period;
    return step < -period / 2 ? step + period : step;
  }

  std::uint64_t pattern_length_;
  std::uint64_t base_ = 0;
  std::uint64_t newest_ = 0;
  std::uint64_t newest_id_ = 0;
  std::uint64_t next_sequence_ = 0;
  bool has_start_ = false;
  bool has_any_ = false;
  bool counts_from_zero_ = false;
};

}  // namespace striper::detail
