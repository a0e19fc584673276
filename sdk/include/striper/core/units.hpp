// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

namespace striper {

// What people write and read in other units than the SI that is inside: `5.0 * kDegree` is 5
// degrees in radians, `way_m / kFoot_m` a way in feet.

inline constexpr double kDegree = std::numbers::pi / 180.0;  ///< Radians.
inline constexpr double kInch_m = 0.0254;                    ///< International yard, 1959: exact,
inline constexpr double kFoot_m = 12.0 * kInch_m;            ///< as is what follows from it.
inline constexpr double kMph_m_s = 5280.0 * kFoot_m / 3600.0;

}  // namespace striper
