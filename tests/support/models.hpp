// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include <striper/model/striper_model.hpp>

namespace striper::testing {

inline double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

/// The paper's striper (Mertz et al. 2002, Figure 1 and Table 1): the camera `baseline_m` straight
/// above the laser, looking along the laser plane, 640x480 pixels.
inline StriperModel paper_model(double fov_deg = 55.0, double baseline_m = 0.5) {
  const double f = 320.0 / std::tan(radians(fov_deg) / 2.0);
  StriperModel model;
  model.camera = CameraModel(640, 480, f, f, 319.5, 239.5);
  model.lasers.push_back({LaserPlane(Eigen::Vector3d::UnitY(), baseline_m), {}, {}});
  return model;
}

/// A striper like most: a lens with distortion, the camera pitched down to the plane, the plane a
/// little twisted.
inline StriperModel typical_model(StripeAxis axis = StripeAxis::kColumns) {
  StriperModel model;
  model.camera = CameraModel(640, 480, 615.0, 612.0, 322.5, 236.0, LensModel::kPlumbBob,
                             {-0.27, 0.09, 1e-3, -5e-4, -0.01});
  model.axis = axis;
  const Eigen::Vector3d normal =
      axis == StripeAxis::kColumns
          ? Eigen::Vector3d(0.03, std::cos(radians(14.0)), std::sin(radians(14.0))).normalized()
          : Eigen::Vector3d(0.90, -0.14, 0.40).normalized();
  model.lasers.push_back({LaserPlane(normal, axis == StripeAxis::kColumns ? 0.5 : 0.166), {}, {}});
  return model;
}

/// The wide lens of the paper's cluttered room: 105 degrees across, equidistant.
inline StriperModel wide_model() {
  StriperModel model = typical_model();
  const double f = 320.0 / radians(105.0 / 2.0);
  model.camera = CameraModel(640, 480, f, f, 319.5, 239.5, LensModel::kEquidistant,
                             {-0.02, 0.004, -0.001, 0.0002});
  return model;
}

// A covariance of the size that a good calibration has, of rank 3 over the plane.
inline ModelCovariance plausible_covariance(const StriperModel& model) {
  ModelCovariance covariance;
  for (const std::string_view name : model.camera.parameter_names())
    covariance.parameters.emplace_back(name);
  for (const char* name : {"laser0_nx", "laser0_ny", "laser0_nz", "laser0_d"}) {
    covariance.parameters.emplace_back(name);
  }
  const auto size = static_cast<Eigen::Index>(covariance.parameters.size());
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(size, size - 1);
  const Eigen::Index cameras = size - 4;
  for (Eigen::Index i = 0; i < cameras; ++i) spread(i, i) = i < 4 ? 0.5 : 1e-4;
  const Eigen::Vector3d n = model.lasers[0].plane.normal();
  spread.block<3, 1>(cameras, cameras) = 3e-4 * n.unitOrthogonal();
  spread.block<3, 1>(cameras, cameras + 1) = 5e-4 * n.cross(n.unitOrthogonal());
  spread(size - 1, cameras + 2) = 2e-4;
  spread(0, cameras + 2) = 0.3;  // Focal length and distance are correlated, as in life.
  covariance.matrix = spread * spread.transpose();
  return covariance;
}

}  // namespace striper::testing
