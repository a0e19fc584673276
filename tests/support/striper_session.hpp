// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <striper/board/observations.hpp>
#include <striper/model/camera_model.hpp>
#include <striper/model/laser_plane.hpp>

#include "support/random.hpp"

namespace striper::testing {

/// A striper with known truth, and how its calibration images are made: points alone, no
/// rendering. The geometry is that of the design's accuracy study: 640x480, 55 degrees, camera
/// pitched down 14 degrees, laser plane 0.5 m below the camera, 9x6 board of 60 mm at 0.9-2.6 m.
struct SyntheticStriper {
  CameraModel camera{640,
                     480,
                     614.7,
                     614.7,
                     319.5,
                     239.5,
                     LensModel::kPlumbBob,
                     {-0.25, 0.10, 0.0005, -0.0003, 0.0}};
  LaserPlane plane = pitched_plane(14.0, 0.5);
  Board board{Board::Pattern::kCheckerboard, 9, 6, 0.060};
  double corner_sigma_px = 0.1;
  double stripe_sigma_px = 0.05;
  Eigen::Vector2d bend_m = Eigen::Vector2d::Zero();  ///< How the true board is bent.
  int stripe_step = 1;                               ///< Every n-th column has a stripe point.

  /// A horizontal plane `baseline_m` below a camera that looks down by `pitch_deg`.
  static LaserPlane pitched_plane(double pitch_deg, double baseline_m) {
    const double pitch = pitch_deg * std::numbers::pi / 180.0;
    return {Eigen::Vector3d(0.0, std::cos(pitch), std::sin(pitch)), baseline_m};
  }
};

/// A board pose: its centre at (u, v) of the image and `depth_m`, turned by rotations about the
/// camera's x, y and z axes.
struct BoardPose {
  double u_px, v_px, depth_m;
  double about_x_deg, about_y_deg, about_z_deg;
};

inline Eigen::Isometry3d T_cam_board(const SyntheticStriper& striper, const BoardPose& pose) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = (Eigen::AngleAxisd(pose.about_x_deg * kDegree, Eigen::Vector3d::UnitX()) *
                Eigen::AngleAxisd(pose.about_y_deg * kDegree, Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(pose.about_z_deg * kDegree, Eigen::Vector3d::UnitZ()))
                   .toRotationMatrix();
  const auto ray = striper.camera.unproject({pose.u_px, pose.v_px});
  const Eigen::Vector2d centre = striper.board.centre_m();
  T.translation() = pose.depth_m * Eigen::Vector3d(ray.xy.x(), ray.xy.y(), 1.0) -
                    T.linear() * Eigen::Vector3d(centre.x(), centre.y(), 0.0);
  return T;
}

/// The true point of a board, bend included (positive: the middle towards the camera).
inline Eigen::Vector3d bent_point(const SyntheticStriper& striper, const Eigen::Vector2d& p) {
  const Eigen::Vector2d a =
      (p - striper.board.centre_m()).cwiseQuotient(striper.board.half_extent_m());
  return {
      p.x(), p.y(),
      -(striper.bend_m.x() * (1.0 - a.x() * a.x()) + striper.bend_m.y() * (1.0 - a.y() * a.y()))};
}

/// The noise-free stripe row in each column of the image where the laser meets the board's print,
/// (flat) board.
inline std::vector<Eigen::Vector2d> stripe_on_board(const SyntheticStriper& striper,
                                                    const Eigen::Isometry3d& T) {
  // Walk along the line in which the two planes meet, projecting densely, and read the row at whole
  // columns by interpolation on a fine grid.
  const Eigen::Vector3d n = T.linear().transpose() * striper.plane.normal();
  const double d = striper.plane.distance_m() - striper.plane.normal().dot(T.translation());
  const Eigen::Vector2d n2 = n.head<2>();
  std::vector<Eigen::Vector2d> pixels;
  if (n2.norm() < 1e-6) return pixels;
  const Eigen::Vector2d foot = n2 * (d / n2.squaredNorm());
  const Eigen::Vector2d along = Eigen::Vector2d(-n2.y(), n2.x()).normalized();
  const Eigen::Vector2d low = Eigen::Vector2d::Constant(-striper.board.square_m);
  const Eigen::Vector2d high =
      2.0 * striper.board.half_extent_m() + Eigen::Vector2d::Constant(striper.board.square_m);
  const auto on_board = [&](const Eigen::Vector2d& p) {
    return (p.array() >= low.array()).all() && (p.array() <= high.array()).all();
  };
  const auto pixel_at = [&](double t) {
    const Eigen::Vector2d p = foot + t * along;
    return striper.camera.project(T * Eigen::Vector3d(p.x(), p.y(), 0.0));
  };
  for (int u = 0; u < striper.camera.width(); u += striper.stripe_step) {
    // Solve u(t) = u by bisection-free secant steps: u is monotonic along a line in front.
    double t = 0.0;
    bool ok = false;
    for (int i = 0; i < 30; ++i) {
      const auto here = pixel_at(t);
      const auto next = pixel_at(t + 1e-6);
      if (here.status != CameraStatus::kOk || next.status != CameraStatus::kOk) break;
      const double slope = (next.pixel.x() - here.pixel.x()) / 1e-6;
      if (std::abs(slope) < 1.0) break;
      const double step = (u - here.pixel.x()) / slope;
      t += std::clamp(step, -0.3, 0.3);
      if (std::abs(step) < 1e-12) {
        ok = true;
        break;
      }
    }
    if (!ok || !on_board(foot + t * along)) continue;
    const auto at = pixel_at(t);
    if (at.status == CameraStatus::kOk && at.pixel.y() >= 0.0 &&
        at.pixel.y() <= striper.camera.height() - 1)
      pixels.push_back(at.pixel);
  }
  return pixels;
}

/// Adds one noisy image of the board with the stripe on it. False, and nothing added, where part
/// of the board is outside of the image or the stripe covers less than 40 columns of it.
inline bool add_view(const SyntheticStriper& striper, const Eigen::Isometry3d& T,
                     Observations& observations, bool needs_stripe = true) {
  CornerView view;
  for (int i = 0; i < striper.board.point_count(); ++i) {
    const auto at = striper.camera.project(T * bent_point(striper, striper.board.point_m(i)));
    if (at.status != CameraStatus::kOk || at.pixel.minCoeff() < 3.0 ||
        at.pixel.x() > striper.camera.width() - 4 || at.pixel.y() > striper.camera.height() - 4)
      return false;
    view.point.push_back(i);
    view.pixel.push_back(at.pixel + Eigen::Vector2d(normal(0.0, striper.corner_sigma_px),
                                                    normal(0.0, striper.corner_sigma_px)));
  }
  StripeView stripe;
  for (const Eigen::Vector2d& pixel : stripe_on_board(striper, T)) {
    stripe.pixel.push_back(pixel + Eigen::Vector2d(0.0, normal(0.0, striper.stripe_sigma_px)));
    stripe.sigma_px.push_back(striper.stripe_sigma_px);
  }
  const bool has_stripe = stripe.pixel.size() * static_cast<std::size_t>(striper.stripe_step) >= 40;
  if (needs_stripe && !has_stripe) return false;
  view.name = "view" + std::to_string(observations.views.size());
  stripe.name = view.name;
  stripe.view = static_cast<int>(observations.views.size());
  observations.views.push_back(std::move(view));
  if (has_stripe) observations.stripes.push_back(std::move(stripe));
  return true;
}

inline Observations empty_observations(const SyntheticStriper& striper) {
  Observations observations;
  observations.board = striper.board;
  observations.image_width = striper.camera.width();
  observations.image_height = striper.camera.height();
  observations.axis = StripeAxis::kColumns;
  return observations;
}

/// `count` boards at random depths, tilts of up to 40 degrees each way and places in the image.
inline Observations varied_boards(const SyntheticStriper& striper, int count) {
  Observations observations = empty_observations(striper);
  while (static_cast<int>(observations.views.size()) < count)
    add_view(
        striper,
        T_cam_board(striper, {uniform(100.0, 540.0), uniform(100.0, 400.0), uniform(0.9, 2.6),
                              uniform(-40.0, 40.0), uniform(-40.0, 40.0), uniform(-15.0, 15.0)}),
        observations);
  return observations;
}

/// `count` boards near enough to fill much of a camera's image, without stripes: for its lens.
inline Observations lens_boards(const CameraModel& camera, std::size_t count) {
  SyntheticStriper striper;
  striper.camera = camera;
  striper.stripe_step = 64;
  Observations observations = empty_observations(striper);
  while (observations.views.size() < count)
    add_view(
        striper,
        T_cam_board(striper, {uniform(120.0, 520.0), uniform(110.0, 370.0), uniform(0.7, 1.4),
                              uniform(-40.0, 40.0), uniform(-40.0, 40.0), uniform(-15.0, 15.0)}),
        observations, false);
  observations.stripes.clear();
  return observations;
}

/// Varied boards with tilts drawn from a range about a common attitude.
inline Observations boards_tilted(const SyntheticStriper& striper, int count, double about_x_deg,
                                  double spread_deg) {
  Observations observations = empty_observations(striper);
  while (static_cast<int>(observations.views.size()) < count)
    add_view(striper,
             T_cam_board(striper, {uniform(150.0, 490.0), uniform(150.0, 380.0), uniform(0.9, 2.6),
                                   about_x_deg + uniform(-spread_deg, spread_deg),
                                   uniform(-spread_deg, spread_deg), uniform(-15.0, 15.0)}),
             observations);
  return observations;
}

}  // namespace striper::testing
