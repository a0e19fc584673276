// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// Where a surface ends for the camera: half the spacing of its returns beyond the outermost, since
/// it ends anywhere up to the next one.
///
/// A column that sees the surface with a part of its width, or through the lens's blur alone, shows
/// it dimmer: the outermost is that which is at least half as bright as the surface is further
/// inside. Where the next columns see something as bright that cannot be trusted, as those do that
/// see the edge itself, it ends anywhere up to the next one beyond these.
struct SurfaceEdge {
  Eigen::Vector2d direction{1.0, 0.0};  // From the pivot, unit vector.
  double q = 0.0;                       // 1/distance there, on the surface's line.
  Eigen::Vector2d at_m{0.0, 0.0};       // Scan frame.
  double sigma_m = 0.0;  // Along the line: of a uniform distribution over these columns.
};

/// Of the surface of elements `from` to `to`, the latter not included; two or more.
SurfaceEdge edge_beyond(const InverseRanges& ranges, const LineFit& fit, std::size_t from,
                        std::size_t to, bool is_end) noexcept;

}  // namespace striper::detail
