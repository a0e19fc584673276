// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace striper {

/// Which light an exposure was made with: unknown, dark (no laser), or the index of the laser that
/// fired.
class Illumination {
 public:
  constexpr Illumination() noexcept = default;

  static constexpr Illumination unknown() noexcept { return Illumination(kUnknown); }
  static constexpr Illumination dark() noexcept { return Illumination(kDark); }
  static constexpr Illumination laser(int index) noexcept { return Illumination(index); }

  constexpr bool is_unknown() const noexcept { return value_ == kUnknown; }
  constexpr bool is_dark() const noexcept { return value_ == kDark; }
  constexpr bool is_lit() const noexcept { return value_ >= 0; }

  /// The index of the laser that fired. Precondition: `is_lit()`.
  constexpr int laser_index() const noexcept { return value_; }

  friend constexpr bool operator==(Illumination, Illumination) noexcept = default;

 private:
  static constexpr int kUnknown = -2;
  static constexpr int kDark = -1;

  explicit constexpr Illumination(int value) noexcept : value_(value) {}

  int value_ = kUnknown;
};

}  // namespace striper
