// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <striper/simulator/material.hpp>

namespace striper {

// The shapes. Each is given in its object's own frame: x forward, y left, z up, like the world.
// Flat shapes stand upright and show their front to a striper that looks along +x: normal -x,
// `right` = -y, `up` = +z. Both sides are visible.

/// An endless plane: x = 0 of the object's frame.
struct Plane {};

/// A rectangle in x = 0, centred: `width_m` along y, `height_m` along z.
struct Rectangle {
  double width_m = 1.0;
  double height_m = 1.0;
};

/// A disc in x = 0, centred.
struct Disc {
  double radius_m = 0.1;
};

/// A box, centred, with its edges along the axes.
struct Box {
  Eigen::Vector3d size_m = Eigen::Vector3d::Ones();
};

/// A closed cylinder, centred, its axis along z.
struct Cylinder {
  double radius_m = 0.1;
  double length_m = 1.0;
};

/// A profile of straight pieces in the y-z plane, swept along x: a kerb, a wall, a gutter.
struct Sweep {
  std::vector<Eigen::Vector2d> profile_m;  ///< (y, z), at least two points.
  double length_m = 10.0;                  ///< Along x, half of it on either side of x = 0.
};

using Shape = std::variant<Plane, Rectangle, Disc, Box, Cylinder, Sweep>;

/// How something moves: with a constant velocity, and turning about its own origin.
struct SteadyMotion {
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();            ///< World axes.
  Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();  ///< World axes.

  bool is_still() const noexcept {
    return velocity_m_s.isZero(0.0) && angular_velocity_rad_s.isZero(0.0);
  }
  /// The pose at a time, from the pose at time zero.
  Eigen::Isometry3d moved(const Eigen::Isometry3d& pose, double time_s) const;
};

/// One thing in the scene.
struct SceneObject {
  std::string name;  ///< For messages and truth; need not be unique.
  Shape shape = Plane{};
  Material material;
  Eigen::Isometry3d T_world_object = Eigen::Isometry3d::Identity();  ///< At time zero.
  SteadyMotion motion;
};

/// The rotation that shows a flat shape's front along `normal`: its `up` is as near to the world's
/// z as it can be, or the world's x where the normal is vertical.
Eigen::Matrix3d facing(const Eigen::Vector3d& normal);

/// The rotation of roll, pitch and yaw about the fixed axes x, y and z, in this order (REP 103).
Eigen::Matrix3d rotation_from_rpy(double roll_rad, double pitch_rad, double yaw_rad);

}  // namespace striper
