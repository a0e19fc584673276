// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

namespace striper {

/// What the scan lines are, each of which gives one return.
enum class StripeAxis {
  kColumns,  ///< One return per image column, searched along v: a stripe that runs left to right.
  kRows,     ///< One return per image row, searched along u: a stripe that runs top to bottom.
};

/// `columns` or `rows`. Static storage.
constexpr std::string_view to_string(StripeAxis axis) noexcept {
  return axis == StripeAxis::kColumns ? "columns" : "rows";
}

/// The inverse; empty for any other word.
constexpr std::optional<StripeAxis> stripe_axis_from_string(std::string_view word) noexcept {
  if (word == "columns") return StripeAxis::kColumns;
  if (word == "rows") return StripeAxis::kRows;
  return std::nullopt;
}

}  // namespace striper
