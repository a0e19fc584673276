// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include <striper/simulator/scene.hpp>

namespace striper::testing {

/// Indoor light without a laser, numbers large enough to see small differences.
inline Scene lit_scene() {
  Scene scene;
  scene.lasers[0].pulse_energy_j = 0.0;
  scene.imager.bit_depth = 16;
  scene.imager.dn_per_electron = 10.0;
  scene.imager.black_level_dn = 0.0;
  scene.daylight.ambient_w_m2_nm = 1.0;
  return scene;
}

/// A shape of the default material, not turned.
inline SceneObject object(const Shape& shape, const Eigen::Vector3d& position) {
  SceneObject result;
  result.shape = shape;
  result.T_world_object.translation() = position;
  return result;
}

}  // namespace striper::testing
