// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include <striper/model/laser_plane.hpp>

namespace striper {

/// Fits a plane through 3-D points, most of which lie on it: least median of squares over random
/// triples (Rousseeuw 1984; always the same draws), then least squares over the inliers.
/// @param points_cam points of the camera frame, metres.
/// @return empty for fewer than three points, or points on a line.
std::optional<LaserPlane> fit_plane(const std::vector<Eigen::Vector3d>& points_cam);

}  // namespace striper
