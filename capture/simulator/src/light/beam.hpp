// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include <striper/model/laser_plane.hpp>
#include <striper/simulator/scene.hpp>

#include "scene/world.hpp"

namespace striper::detail {

/// What a laser sends to a point of a surface, the Gaussian across its plane left open: the fluence
/// there is peak_fluence_j_m2 * exp(-h^2 / (2 sigma_m^2)), h being the point's distance from the
/// plane.
struct BeamAt {
  double peak_fluence_j_m2 = 0.0;  ///< Incidence included; 0 outside the fan or on the far side.
  double sigma_m = 1.0;
  bool in_fan = false;
};

/// A laser in the camera's frame.
class Beam {
 public:
  Beam(const SimulatedLaser& laser, const Scene& scene);

  const Eigen::Vector3d& origin() const noexcept { return origin_; }
  const Eigen::Vector3d& normal() const noexcept { return normal_; }

  /// Signed distance from the laser plane, metres.
  double height_m(const Eigen::Vector3d& point) const noexcept {
    return normal_.dot(point - origin_);
  }

  /// Standard deviation of the laser plane's thickness at a point, metres.
  double sigma_m(const Eigen::Vector3d& point) const noexcept;

  /// @param normal of the surface, turned towards the camera: the laser must shine on that side.
  BeamAt at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const noexcept;

  LaserPlane plane() const;

  /// The facets of a world that come near the laser plane: only they can cast a shadow into the
  /// stripe.
  std::vector<int> casters(const World& world) const;

 private:
  SimulatedLaser laser_;
  Eigen::Vector3d origin_;
  Eigen::Vector3d axis_;     // Middle of the fan.
  Eigen::Vector3d tangent_;  // In the plane, across the fan.
  Eigen::Vector3d normal_;   // Of the plane.
  double cos_half_fan_;
};

}  // namespace striper::detail
