// SPDX-License-Identifier: Apache-2.0
#include "light/beam.hpp"

#include <cmath>

#include <striper/simulator/radiometry.hpp>

namespace striper::detail {

Beam::Beam(const SimulatedLaser& laser, const Scene& scene)
    : laser_(laser), cos_half_fan_(std::cos(0.5 * laser.fan_rad)) {
  const Eigen::Isometry3d T_cam_laser = scene.T_device_cam().inverse() * laser.T_device_laser;
  origin_ = T_cam_laser.translation();
  axis_ = T_cam_laser.linear().col(0);
  tangent_ = T_cam_laser.linear().col(1);
  normal_ = T_cam_laser.linear().col(2);
}

double Beam::sigma_m(const Eigen::Vector3d& point) const noexcept {
  const Eigen::Vector3d offset = point - origin_;
  const double along = axis_.dot(offset);
  const double across = tangent_.dot(offset);
  return thickness_sigma_m(laser_, std::sqrt(along * along + across * across));
}

BeamAt Beam::at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const noexcept {
  const Eigen::Vector3d offset = point - origin_;
  const double along = axis_.dot(offset);
  const double across = tangent_.dot(offset);
  const double distance = std::sqrt(along * along + across * across);
  BeamAt light;
  light.in_fan = distance > 0.0 && along >= distance * cos_half_fan_;
  light.sigma_m = thickness_sigma_m(laser_, distance);
  const double cos_incidence = -normal.dot(offset) / offset.norm();
  if (light.in_fan && cos_incidence > 0.0) {
    light.peak_fluence_j_m2 = peak_fluence_j_m2(laser_, distance) * cos_incidence;
  }
  return light;
}

LaserPlane Beam::plane() const { return LaserPlane(normal_, normal_.dot(origin_)); }

std::vector<int> Beam::casters(const World& world) const {
  std::vector<int> near;
  for (std::size_t i = 0; i < world.facets().size(); ++i) {
    const Facet& facet = world.facets()[i];
    const double reach = facet.bounding_radius + 6.0 * sigma_m(facet.center);
    // The laser plane widens with distance, at most by 6 sigma over the facet's own size.
    const double widening = 6.0 * laser_.divergence_sigma_rad * facet.bounding_radius;
    if (std::abs(height_m(facet.center)) <= reach + widening) near.push_back(static_cast<int>(i));
  }
  return near;
}

}  // namespace striper::detail
