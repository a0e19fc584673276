// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Core>
#include <ceres/rotation.h>

#include <striper/model/projection.hpp>

#include "adjust/cost_functions/board_pose.hpp"

namespace striper::detail {

/// A corner, or the dot of a grid of circles, against its projection, in sigmas:
/// (projected - observed) / sigma.
///
/// The image of a dot is no circle, and the centre of its area is not where the circle's centre
/// is seen: seen at 45 degrees it is off by f r^2 / (2 Z^2), a tenth of a pixel (Heikkila 2000).
/// What is compared is the centre of the area, that of a polygon with the disc's second moments.
/// Blocks: camera parameters, pose (angle-axis, translation), and the bend where it is solved for.
struct CornerCost {
  LensModel lens;
  BendShape shape;
  std::array<double, 2> bend;  ///< Where it is not.
  Eigen::Vector2d point_m;
  Eigen::Vector2d pixel;
  double sigma_px;
  double dot_radius_m = 0.0;  ///< 0: a corner.

  template <typename T>
  bool operator()(const T* camera, const T* pose, const T* bend_block, T* residual) const {
    return compare(camera, pose, bend_block, residual);
  }

  template <typename T>
  bool operator()(const T* camera, const T* pose, T* residual) const {
    return compare(camera, pose, bend.data(), residual);
  }

 private:
  static constexpr int kSides = 8;

  template <typename T, typename Bend>
  bool compare(const T* camera, const T* pose, const Bend* bend_m, T* residual) const {
    Eigen::Matrix<T, 2, 1> predicted;
    if (!(dot_radius_m > 0.0 ? project_dot(camera, pose, bend_m, predicted)
                             : project(camera, pose, bend_m, point_m, predicted)))
      return false;
    residual[0] = (predicted.x() - pixel.x()) / sigma_px;
    residual[1] = (predicted.y() - pixel.y()) / sigma_px;
    return true;
  }

  template <typename T, typename Bend>
  bool project(const T* camera, const T* pose, const Bend* bend_m, const Eigen::Vector2d& at_m,
               Eigen::Matrix<T, 2, 1>& projected) const {
    const T p_board[3] = {T(at_m.x()), T(at_m.y()),
                          T(-shape.height(Bend(at_m.x()), Bend(at_m.y()), bend_m))};
    Eigen::Matrix<T, 3, 1> p_cam;
    ceres::AngleAxisRotatePoint(pose, p_board, p_cam.data());
    for (int i = 0; i < 3; ++i) p_cam[i] += pose[3 + i];
    if (p_cam.z() <= T(0.0)) return false;
    projected = project_point(lens, camera, p_cam);
    return true;
  }

  template <typename T, typename Bend>
  bool project_dot(const T* camera, const T* pose, const Bend* bend_m,
                   Eigen::Matrix<T, 2, 1>& centre) const {
    using Vector = Eigen::Matrix<T, 2, 1>;
    constexpr double kTurn = 2.0 * std::numbers::pi / kSides;
    // A disc has r^2 / 4 about each axis, a polygon of circumradius R has R^2 (2 + cos turn) / 12.
    const double circumradius_m = dot_radius_m * std::sqrt(3.0 / (2.0 + std::cos(kTurn)));
    std::array<Vector, kSides> outline;
    for (int i = 0; i < kSides; ++i) {
      const Eigen::Vector2d out(std::cos(i * kTurn), std::sin(i * kTurn));
      if (!project(camera, pose, bend_m, point_m + circumradius_m * out,
                   outline[static_cast<std::size_t>(i)]))
        return false;
    }
    // Triangles from the first vertex: their centres, weighted by their areas.
    T area(0.0);
    Vector moment(T(0.0), T(0.0));
    for (std::size_t i = 1; i + 1 < kSides; ++i) {
      const Vector a = outline[i] - outline[0];
      const Vector b = outline[i + 1] - outline[0];
      const T twice = a.x() * b.y() - a.y() * b.x();
      area += twice;
      moment += twice * (a + b) / T(3.0);
    }
    centre = outline[0] + moment / area;
    return true;
  }
};

}  // namespace striper::detail
