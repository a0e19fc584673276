// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <variant>

#include <fmt/format.h>

#include <striper/scan/polar_scan.hpp>

namespace striper::detail {

/// A number of a return, as files call it.
struct ScanColumn {
  std::string_view name;
  std::variant<double Return::*, float Return::*> member;
  bool is_required = false;  ///< A table of scans of whatever origin must have it.
};

/// In the order of the CSV (CONVENTIONS.md): the CSV and the lines of JSON are made from this.
inline constexpr ScanColumn kScanColumns[] = {
    {"u_px", &Return::u_px},
    {"v_px", &Return::v_px},
    {"bearing_rad", &Return::bearing_rad, true},
    {"range_m", &Return::range_m, true},
    {"range_near_m", &Return::range_near_m},
    {"range_far_m", &Return::range_far_m},
    {"sigma_m", &Return::sigma_m},
    {"sigma_cal_m", &Return::sigma_cal_m},
    {"x_m", &Return::x_m},
    {"y_m", &Return::y_m},
    {"intensity", &Return::intensity_dn},
    {"width_px", &Return::width_px},
    {"row_sigma_px", &Return::row_sigma_px},
    {"confidence", &Return::confidence},
};

/// The column of that name; null where there is none.
inline const ScanColumn* find_scan_column(std::string_view name) noexcept {
  for (const ScanColumn& column : kScanColumns) {
    if (column.name == name) return &column;
  }
  return nullptr;
}

/// Why that is no bearing in radians: more than a whole turn, however it was rounded, is another
/// unit. Empty where it can be one.
inline std::string problem_of_bearing(double bearing_rad) {
  constexpr double kMost_rad = 6.3;
  if (!(std::abs(bearing_rad) > kMost_rad)) return {};
  return fmt::format("bearing_rad is {:g}, more than a whole turn: expected radians, not degrees",
                     bearing_rad);
}

}  // namespace striper::detail
