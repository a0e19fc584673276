// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// Where a surface ends for the camera: half the spacing of its returns beyond the outermost, since
/// it ends anywhere up to the next one.
struct SurfaceEdge {
  Eigen::Vector2d direction{1.0, 0.0};  // From the pivot, unit vector.
  double q = 0.0;                       // 1/distance there, on the surface's line.
  Eigen::Vector2d at_m{0.0, 0.0};       // Scan frame.
  double sigma_m = 0.0;                 // Along the line: spacing / sqrt(12).
};

/// @param outer, inner  the outermost element and the next one inside.
SurfaceEdge edge_beyond(const InverseRanges& ranges, const LineFit& fit, std::size_t outer,
                        std::size_t inner) noexcept;

}  // namespace striper::detail
