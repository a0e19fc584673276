// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "profile/tools/patch.hpp"

namespace striper::detail {

struct EnclosedArea {
  double value_m2 = 0.0;  ///< Positive where the returns lie beyond the line, away from the sensor.
  double variance_m4 = 0.0;
};

/// The area between returns and a straight line. Two patches: all returns of the second's region,
/// and the first's line; half a spacing beyond the outermost returns belongs to it. One patch: all
/// returns of its region, and their chord. Between two returns the surface is taken for straight;
/// where it jumps it does so anywhere between them.
EnclosedArea enclosed_area(const InverseRanges& ranges, const std::vector<Patch>& patches);

/// The returns that enter it.
std::size_t area_points(const std::vector<Patch>& patches) noexcept;

}  // namespace striper::detail
