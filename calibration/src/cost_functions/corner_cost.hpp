// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <ceres/rotation.h>

#include <striper/model/projection.hpp>

#include "cost_functions/board_pose.hpp"

namespace striper::detail {

/// A corner against its projection, in sigmas: (projected - observed) / sigma.
/// Blocks: camera parameters, pose (angle-axis, translation), bend.
struct CornerCost {
  LensModel lens;
  BendShape shape;
  Eigen::Vector2d point_m;
  Eigen::Vector2d pixel;
  double sigma_px;

  template <typename T>
  bool operator()(const T* camera, const T* pose, const T* bend, T* residual) const {
    const T x(point_m.x());
    const T y(point_m.y());
    const T p_board[3] = {x, y, -shape.height(x, y, bend)};
    Eigen::Matrix<T, 3, 1> p_cam;
    ceres::AngleAxisRotatePoint(pose, p_board, p_cam.data());
    for (int i = 0; i < 3; ++i) p_cam[i] += pose[3 + i];
    if (p_cam.z() <= T(0.0)) return false;
    const Eigen::Matrix<T, 2, 1> projected = project_point(lens, camera, p_cam);
    residual[0] = (projected.x() - T(pixel.x())) / T(sigma_px);
    residual[1] = (projected.y() - T(pixel.y())) / T(sigma_px);
    return true;
  }
};

}  // namespace striper::detail
