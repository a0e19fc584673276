// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include <striper/scan/polar_scan.hpp>

namespace striper {

/// To which places a scan is resampled (`--resample`).
struct ResampleGrid {
  enum class Axis { kX, kY, kBearing };

  Axis axis = Axis::kBearing;
  double step = 0.0;  ///< Metres, or radians of bearing; returns are at its whole multiples.
};

/// Reads `x=0.001`, `y=0.001` (metres) or `bearing=0.1` (degrees).
/// @throws Error{kUsage} naming the text and what was expected.
ResampleGrid parse_resample_grid(std::string_view text);

/// Returns `scan` with its ok returns resampled: where the straight line from a return to the next
/// passes a place of the grid there is one, its sigmas those of both. In the order of the scan; a
/// surface that passes a place twice is there twice.
///
/// There is nothing between returns that are not neighbours: where a scan line between them has
/// none, or where they are farther apart than three times what is usual there (an edge). Scan lines
/// that a table of ok returns leaves out are known by the pixels of those it has; where it has none
/// all its returns are neighbours. Only with `fill_gaps_m` a gap, if it is at most so long, is
/// filled: kFilled, and its sigma has the depth of the gap over sqrt(12), for the surface is
/// anywhere in between.
/// @throws Error{kUsage} where a scan line has several returns, or a million places are between
/// two.
PolarScan resampled(const PolarScan& scan, const ResampleGrid& grid,
                    std::optional<double> fill_gaps_m = std::nullopt);

}  // namespace striper
