// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace striper {

/// An option's value that knows whether somebody asked for it: what nobody asked for gives way to
/// what a model says.
///
///     Asked<StripeAxis> axis = Asked<StripeAxis>::otherwise(StripeAxis::kColumns);
///     options.axis = StripeAxis::kRows;  // Asked for.
template <typename Value>
class Asked {
 public:
  /// The default, for which nobody asked.
  static constexpr Asked otherwise(Value value) {
    Asked asked(value);
    asked.is_asked_ = false;
    return asked;
  }

  constexpr Asked(Value value) : value_(value) {}  // NOLINT(google-explicit-constructor)
  constexpr operator Value() const noexcept {
    return value_;
  }  // NOLINT(google-explicit-constructor)

  constexpr bool is_asked() const noexcept { return is_asked_; }

  /// Takes the value unless one was asked for. It is still not asked for.
  constexpr void give_way_to(Value value) noexcept {
    if (!is_asked_) value_ = value;
  }

 private:
  Value value_;
  bool is_asked_ = true;
};

}  // namespace striper
