// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <ceres/rotation.h>

#include <striper/board/board.hpp>

namespace striper::detail {

/// A pose as the solver sees it: angle-axis, then translation. A board that faces the camera never
/// comes near the angle of 2 pi where angle-axis is singular.
using PoseBlock = std::array<double, 6>;

inline PoseBlock to_block(const Eigen::Isometry3d& T) {
  const Eigen::AngleAxisd rotation(T.linear());
  const Eigen::Vector3d w = rotation.angle() * rotation.axis();
  return {w.x(), w.y(), w.z(), T.translation().x(), T.translation().y(), T.translation().z()};
}

inline Eigen::Isometry3d to_isometry(const PoseBlock& block) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d w(block[0], block[1], block[2]);
  if (w.norm() > 0.0) T.linear() = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
  T.translation() << block[3], block[4], block[5];
  return T;
}

/// How a bent board rises over its plane: a parabola in x and one in y, 0 at the outer points and
/// bend_m in the middle.
struct BendShape {
  Eigen::Vector2d centre_m;
  Eigen::Vector2d half_extent_m;

  explicit BendShape(const Board& board)
      : centre_m(board.centre_m()), half_extent_m(board.half_extent_m()) {}

  template <typename T>
  T height(const T& x, const T& y, const T* bend) const {
    const T a = (x - T(centre_m.x())) / T(half_extent_m.x());
    const T b = (y - T(centre_m.y())) / T(half_extent_m.y());
    return bend[0] * (T(1.0) - a * a) + bend[1] * (T(1.0) - b * b);
  }
};

}  // namespace striper::detail
