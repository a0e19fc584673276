// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <Eigen/Core>
#include <ceres/rotation.h>

#include <striper/model/projection.hpp>

#include "cost_functions/board_pose.hpp"

namespace striper::detail {

/// A corner against its projection, in sigmas: (projected - observed) / sigma.
/// Blocks: camera parameters, pose (angle-axis, translation), and the bend where it is solved for.
struct CornerCost {
  LensModel lens;
  BendShape shape;
  std::array<double, 2> bend;  ///< Where it is not.
  Eigen::Vector2d point_m;
  Eigen::Vector2d pixel;
  double sigma_px;

  template <typename T>
  bool operator()(const T* camera, const T* pose, const T* bend_block, T* residual) const {
    const T x(point_m.x());
    const T y(point_m.y());
    return compare(camera, pose, -shape.height(x, y, bend_block), residual);
  }

  template <typename T>
  bool operator()(const T* camera, const T* pose, T* residual) const {
    return compare(camera, pose, T(-shape.height(point_m.x(), point_m.y(), bend.data())), residual);
  }

 private:
  template <typename T>
  bool compare(const T* camera, const T* pose, const T& z_board, T* residual) const {
    const T p_board[3] = {T(point_m.x()), T(point_m.y()), z_board};
    Eigen::Matrix<T, 3, 1> p_cam;
    ceres::AngleAxisRotatePoint(pose, p_board, p_cam.data());
    for (int i = 0; i < 3; ++i) p_cam[i] += pose[3 + i];
    if (p_cam.z() <= T(0.0)) return false;
    const Eigen::Matrix<T, 2, 1> projected = project_point(lens, camera, p_cam);
    residual[0] = (projected.x() - pixel.x()) / sigma_px;
    residual[1] = (projected.y() - pixel.y()) / sigma_px;
    return true;
  }
};

}  // namespace striper::detail
