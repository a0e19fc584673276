// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <striper/core/frame.hpp>

namespace striper::detail {

/// Gives every exposure of a stream a number that grows, whose place in the pattern is that of the
/// source's own number.
class ExposureNumbers {
 public:
  struct Place {
    std::uint64_t number = 0;
    bool is_restart = false;   ///< The source counts anew: what was found out may not hold.
    bool is_reopened = false;  ///< Nor may what it was said to be in the phase of.
  };

  /// A source that repeats one number does not count at all; its exposures are counted here.
  Place next(const Frame& exposure) noexcept {
    const std::uint64_t own = exposure.exposure_number();
    Place place;
    if (has_last_ && own == last_own_) {
      ++offset_;
    } else if (has_last_ && own < last_own_) {
      place.is_restart = true;
      offset_ += (last_own_ / kWhole + 1) * kWhole;
    }
    place.is_reopened = has_last_ && exposure.epoch != last_epoch_;
    has_last_ = true;
    last_own_ = own;
    last_epoch_ = exposure.epoch;
    place.number = own + offset_;
    return place;
  }

 private:
  // A multiple of every period up to 16, and of two exposures a frame.
  static constexpr std::uint64_t kWhole = 720720;

  bool has_last_ = false;
  std::uint64_t last_own_ = 0;
  std::uint32_t last_epoch_ = 0;
  std::uint64_t offset_ = 0;
};

}  // namespace striper::detail
