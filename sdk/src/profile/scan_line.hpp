// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/geometry/line_fit.hpp>
#include <striper/profile/segments.hpp>

namespace striper::detail {

/// The line p0 (x - pivot_x) + p1 (y - pivot_y) = 1 of the scan frame, with its covariance times
/// scale^2.
ScanLine scan_line(const LineFit& fit, double scale, const Eigen::Vector2d& pivot_m) noexcept;

}  // namespace striper::detail
