// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Geometry>

#include <striper/board/observations.hpp>
#include <striper/model/camera_model.hpp>

namespace striper {

/// Finds a camera to start the adjustment from: the principal point in the middle, no distortion,
/// and the focal length that explains the boards best.
///
/// For lenses near a pinhole it is Zhang's closed form (2000, eqs. 3-4, with the principal point
/// known); a scan over focal lengths with the pose from each homography guards it, and is the only
/// start for `kEquidistant`, which has no homography.
/// @throws Error{kUntrustworthy} where no focal length gives poses for the views.
CameraModel initial_camera(const Observations& observations, LensModel lens);

/// The pose of one board from its homography to undistorted rays. Empty where it cannot be had
/// (fewer than four points, points without a ray, all points on a line).
std::optional<Eigen::Isometry3d> initial_pose(const CameraModel& camera, const Board& board,
                                              const CornerView& view);

}  // namespace striper
