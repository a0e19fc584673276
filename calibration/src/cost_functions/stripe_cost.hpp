// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <ceres/jet.h>
#include <ceres/rotation.h>

#include <striper/model/projection.hpp>

#include "cost_functions/board_pose.hpp"

namespace striper::detail {

inline double scalar(double x) { return x; }
template <typename T, int N>
double scalar(const ceres::Jet<T, N>& x) {
  return scalar(x.a);
}

/// The undistorted ray of a pixel as a function of the camera parameters: Newton's method in
/// double, then one Newton step in T, which leaves the value and adds the exact derivative (the
/// implicit function theorem).
/// @param count parameters of the camera; @param guess where Newton starts. False where it fails.
template <typename T>
bool ray_of_pixel(LensModel lens, const T* camera, int count, const Eigen::Vector2d& pixel,
                  const Eigen::Vector2d& guess, Eigen::Matrix<T, 2, 1>& xy) {
  using Jet2 = ceres::Jet<double, 2>;
  double values[12];
  Jet2 jets[12];
  for (int i = 0; i < count; ++i) jets[i] = Jet2(values[i] = scalar(camera[i]));
  Eigen::Vector2d at = guess;
  Eigen::Matrix2d inverse;
  for (int iteration = 0;; ++iteration) {
    const Eigen::Matrix<Jet2, 2, 1> q = project_normalized<Jet2>(
        lens, jets, Eigen::Matrix<Jet2, 2, 1>(Jet2(at.x(), 0), Jet2(at.y(), 1)));
    Eigen::Matrix2d J;
    J.row(0) = q.x().v.transpose();
    J.row(1) = q.y().v.transpose();
    inverse = J.inverse();
    const Eigen::Vector2d step = inverse * (pixel - Eigen::Vector2d(q.x().a, q.y().a));
    if (!step.allFinite() || iteration == 20) return false;
    if (step.norm() < 1e-13) break;
    at += step;
  }
  const Eigen::Matrix<T, 2, 1> q =
      project_normalized<T>(lens, camera, Eigen::Matrix<T, 2, 1>(T(at.x()), T(at.y())));
  const T du = T(pixel.x()) - q.x();
  const T dv = T(pixel.y()) - q.y();
  xy = {T(at.x()) + T(inverse(0, 0)) * du + T(inverse(0, 1)) * dv,
        T(at.y()) + T(inverse(1, 0)) * du + T(inverse(1, 1)) * dv};
  return true;
}

/// The point of a pixel's ray on the (possibly bent) board, camera frame.
template <typename T>
Eigen::Matrix<T, 3, 1> point_on_board(const Eigen::Matrix<T, 2, 1>& xy, const T* pose,
                                      const T* bend, const BendShape& shape) {
  using Vector = Eigen::Matrix<T, 3, 1>;
  // Camera centre and ray in the board frame, where the board is z = -height(x, y).
  const T back[3] = {-pose[0], -pose[1], -pose[2]};
  const T ray_cam[3] = {xy.x(), xy.y(), T(1.0)};
  const T minus_t[3] = {-pose[3], -pose[4], -pose[5]};
  T ray[3];
  T centre[3];
  ceres::AngleAxisRotatePoint(back, ray_cam, ray);
  ceres::AngleAxisRotatePoint(back, minus_t, centre);
  T along = -centre[2] / ray[2];
  // The bend is small against the distance: each pass gains three digits or more.
  if (scalar(bend[0]) != 0.0 || scalar(bend[1]) != 0.0 || !std::is_same_v<T, double>)
    for (int pass = 0; pass < 4; ++pass) {
      const T x = centre[0] + along * ray[0];
      const T y = centre[1] + along * ray[1];
      along = (-centre[2] - shape.height(x, y, bend)) / ray[2];
    }
  return Vector(along * xy.x(), along * xy.y(), along);
}

/// A stripe pixel against the laser plane, in sigmas. w . P - 1 for the point P of the board that
/// the pixel sees, times `weight`, which makes it the distance in the image along the pixel's line
/// (|d(w . P)/d across| * sigma)^-1 and is held fixed during a solve: where the residual is zero it
/// changes nothing to first order.
/// Blocks: camera parameters, pose, bend, plane w = n / d.
struct StripeCost {
  LensModel lens;
  int camera_count;
  BendShape shape;
  Eigen::Vector2d pixel;
  Eigen::Vector2d ray_guess;
  double weight;

  template <typename T>
  bool operator()(const T* camera, const T* pose, const T* bend, const T* plane,
                  T* residual) const {
    Eigen::Matrix<T, 2, 1> xy;
    if (!ray_of_pixel<T>(lens, camera, camera_count, pixel, ray_guess, xy)) return false;
    const Eigen::Matrix<T, 3, 1> p = point_on_board<T>(xy, pose, bend, shape);
    residual[0] = T(weight) * (plane[0] * p.x() + plane[1] * p.y() + plane[2] * p.z() - T(1.0));
    return true;
  }
};

}  // namespace striper::detail
