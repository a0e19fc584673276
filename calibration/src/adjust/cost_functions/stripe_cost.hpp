// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>
#include <Eigen/LU>
#include <ceres/jet.h>
#include <ceres/rotation.h>

#include <striper/core/stripe_axis.hpp>
#include <striper/model/projection.hpp>

#include "adjust/cost_functions/board_pose.hpp"

namespace striper::detail {

inline double scalar(double x) { return x; }
template <typename T, int N>
double scalar(const ceres::Jet<T, N>& x) {
  return scalar(x.a);
}

/// The point of a ray on the (possibly bent) board, camera frame. @param bend null: a flat board.
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
  for (int pass = 0; bend != nullptr && pass < 4; ++pass) {
    const T x = centre[0] + along * ray[0];
    const T y = centre[1] + along * ray[1];
    along = (-centre[2] - shape.height(x, y, bend)) / ray[2];
  }
  return Vector(along * xy.x(), along * xy.y(), along);
}

/// Where the line in which laser plane and board meet crosses one column (kColumns) or row (kRows)
/// of the image, as a function of camera, pose, bend and plane.
///
/// Two equations for the ray (x, y): it projects to the column, and its point on the board is on
/// the laser plane, w . P = 1. Newton's method in double, then one Newton step in T, which leaves
/// the value and adds the exact derivative (the implicit function theorem).
struct StripeCrossing {
  LensModel lens;
  int camera_count;  ///< Parameters of the camera.
  BendShape shape;
  StripeAxis axis;
  double along_px;        ///< Which column or row.
  Eigen::Vector2d start;  ///< A ray near the crossing.

  /// @param bend null: a flat board. @param across_px receives v (kColumns) or u (kRows). False
  /// where there is no crossing, or none is found from `start`.
  template <typename T>
  bool operator()(const T* camera, const T* pose, const T* bend, const T* plane,
                  T& across_px) const {
    const std::optional<Crossing> found = find(camera, pose, bend, plane);
    if (!found) return false;
    const auto at = equations<T>({camera, pose, bend, plane},
                                 Eigen::Matrix<T, 2, 1>(T(found->xy.x()), T(found->xy.y())));
    across_px = at.across_px - (found->gain[0] * at.f[0] + found->gain[1] * at.f[1]);
    return true;
  }

  /// The ray of the crossing, for the next start.
  std::optional<Eigen::Vector2d> ray(const double* camera, const double* pose, const double* bend,
                                     const double* plane) const {
    const std::optional<Crossing> found = find(camera, pose, bend, plane);
    if (!found) return std::nullopt;
    return found->xy;
  }

 private:
  template <typename T>
  struct Blocks {
    const T* camera;
    const T* pose;
    const T* bend;  // Null: a flat board.
    const T* plane;
  };

  template <typename T>
  struct Equations {
    Eigen::Matrix<T, 2, 1> f;  // What must be zero.
    T across_px;               // Where the ray projects to across the stripe.
  };

  struct Crossing {
    Eigen::Vector2d xy;       // The ray.
    Eigen::RowVector2d gain;  // Change of across_px with that of the equations.
  };

  template <typename T>
  Equations<T> equations(const Blocks<T>& b, const Eigen::Matrix<T, 2, 1>& xy) const {
    const bool columns = axis == StripeAxis::kColumns;
    const Eigen::Matrix<T, 2, 1> q = project_normalized<T>(lens, b.camera, xy);
    const Eigen::Matrix<T, 3, 1> p = point_on_board<T>(xy, b.pose, b.bend, shape);
    return {{(columns ? q.x() : q.y()) - along_px,
             b.plane[0] * p.x() + b.plane[1] * p.y() + b.plane[2] * p.z() - 1.0},
            columns ? q.y() : q.x()};
  }

  template <typename T>
  std::optional<Crossing> find(const T* camera, const T* pose, const T* bend,
                               const T* plane) const {
    using Jet = ceres::Jet<double, 2>;
    const auto constant = [](const T* values, int count, auto& jets) {
      for (int i = 0; i < count; ++i) jets[static_cast<std::size_t>(i)] = Jet(scalar(values[i]));
    };
    std::array<Jet, 12> camera_jets;
    std::array<Jet, 6> pose_jets;
    std::array<Jet, 2> bend_jets;
    std::array<Jet, 3> plane_jets;
    constant(camera, camera_count, camera_jets);
    constant(pose, 6, pose_jets);
    constant(plane, 3, plane_jets);
    if (bend != nullptr) constant(bend, 2, bend_jets);
    const Blocks<Jet> jets{camera_jets.data(), pose_jets.data(),
                           bend == nullptr ? nullptr : bend_jets.data(), plane_jets.data()};
    constexpr int kMostIterations = 20;
    Eigen::Vector2d xy = start;
    for (int iteration = 0; iteration < kMostIterations; ++iteration) {
      const auto at = equations<Jet>(jets, {Jet(xy.x(), 0), Jet(xy.y(), 1)});
      Eigen::Matrix2d J;
      J.row(0) = at.f[0].v.transpose();
      J.row(1) = at.f[1].v.transpose();
      const Eigen::Matrix2d inverse = J.inverse();
      const Eigen::Vector2d step = inverse * Eigen::Vector2d(at.f[0].a, at.f[1].a);
      if (!step.allFinite()) return std::nullopt;
      // The last step, in T, squares it.
      if (step.norm() < 1e-8) return Crossing{xy, at.across_px.v.transpose() * inverse};
      xy -= step;
    }
    return std::nullopt;
  }
};

/// A stripe pixel against the stripe that camera, pose and plane predict in its column or row, in
/// sigmas: (observed - predicted) / sigma.
///
/// Observed minus predicted in the image, and not the distance of the pixel's point from the plane
/// times a weight: that distance has the noise inside of the function and not beside it (errors in
/// variables), and the least squares of thousands of stripe points is then off by more than a
/// standard error of a range.
/// Blocks: camera parameters, pose, the bend where it is solved for, plane w = n / d.
struct StripeCost {
  StripeCrossing crossing;
  std::array<double, 2> bend;  ///< Where it is not.
  double across_px;            ///< Observed.
  double sigma_px;

  template <typename T>
  bool operator()(const T* camera, const T* pose, const T* bend_block, const T* plane,
                  T* residual) const {
    T predicted_px;
    if (!crossing(camera, pose, bend_block, plane, predicted_px)) return false;
    residual[0] = (across_px - predicted_px) / sigma_px;
    return true;
  }

  template <typename T>
  bool operator()(const T* camera, const T* pose, const T* plane, T* residual) const {
    if (bend[0] == 0.0 && bend[1] == 0.0)
      return (*this)(camera, pose, static_cast<const T*>(nullptr), plane, residual);
    const T constant[2] = {T(bend[0]), T(bend[1])};
    return (*this)(camera, pose, constant, plane, residual);
  }
};

}  // namespace striper::detail
