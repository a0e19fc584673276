// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::detail {

/// @throws Error{kBadValue} naming the field, the value and the bounds, both of which are allowed;
/// NaN is within none.
inline void require_between(std::string_view field, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw Error(ErrorKind::kBadValue,
              fmt::format("{} is {:g}, expected {:g} to {:g}", field, value, low, high));
}

/// The same with a finite value and no upper bound.
inline void require_at_least(std::string_view field, double value, double low) {
  if (value >= low && std::isfinite(value)) return;
  throw Error(ErrorKind::kBadValue,
              fmt::format("{} is {:g}, expected at least {:g}", field, value, low));
}

}  // namespace striper::detail
