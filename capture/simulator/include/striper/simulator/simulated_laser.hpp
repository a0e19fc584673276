// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace striper {

/// A line laser: a fan of light from one point, uniform across its angle, Gaussian across its
/// plane.
///
/// The laser plane is the x-y plane of the laser's frame, the middle of the fan its x axis. At the
/// distance rho from the origin its thickness has the standard deviation
/// sqrt(waist_sigma_m^2 + (divergence_sigma_rad (rho - focus_m))^2), and the pulse's fluence on a
/// surface that faces the laser is E / (fan rho) / (sqrt(2 pi) sigma) exp(-h^2 / (2 sigma^2)),
/// h being the distance from the laser plane.
///
/// What data sheets call thickness is taken as energy over peak: sqrt(2 pi) sigma. So a fan of the
/// paper's "60 x 0.4 degrees" has at its peak the very irradiance that the same pulse has when
/// spread evenly over 60 x 0.4 degrees.
struct SimulatedLaser {
  /// Pose on the device (origin: camera centre; x forward, y left, z up).
  Eigen::Isometry3d T_device_laser = Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, -0.5));
  double fan_rad = std::numbers::pi / 3.0;  ///< Full angle of the fan.
  double waist_sigma_m = 0.0;
  double divergence_sigma_rad = thickness_to_sigma(0.4 * std::numbers::pi / 180.0);
  double focus_m = 0.0;  ///< Distance of the waist from the origin.
  double wavelength_nm = 900.0;
  double pulse_energy_j = 10.4e-6;  ///< Emitted during every exposure that this laser lights.
  bool is_continuous = false;  ///< It shines on: the energy goes with the time of the exposure.

  /// Thickness (energy over peak) to standard deviation, metres or radians.
  static constexpr double thickness_to_sigma(double thickness) noexcept {
    return thickness / 2.5066282746310002;  // sqrt(2 pi)
  }
};

}  // namespace striper
