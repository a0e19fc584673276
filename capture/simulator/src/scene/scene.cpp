// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/simulator/scene.hpp>

namespace striper {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

double half_angle_rad(double fov_deg, double limit_deg) {
  if (!(fov_deg > 0.0 && fov_deg < limit_deg)) {
    throw Error(ErrorKind::kBadValue, fmt::format("field of view {} degrees - expected more than 0 "
                                                  "and less than {}",
                                                  fov_deg, limit_deg));
  }
  return 0.5 * fov_deg * kRadiansPerDegree;
}

}  // namespace

Eigen::Matrix3d rotation_from_rpy(double roll_rad, double pitch_rad, double yaw_rad) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  return (AngleAxisd(yaw_rad, Vector3d::UnitZ()) * AngleAxisd(pitch_rad, Vector3d::UnitY()) *
          AngleAxisd(roll_rad, Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Matrix3d facing(const Eigen::Vector3d& normal) {
  const Eigen::Vector3d forward = -normal.normalized();
  const bool is_upright = std::abs(forward.z()) < 1.0 - 1e-9;
  const Eigen::Vector3d wanted =
      is_upright ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d up = (wanted - wanted.dot(forward) * forward).normalized();
  Eigen::Matrix3d rotation;
  rotation << forward, up.cross(forward), up;
  return rotation;
}

Eigen::Isometry3d SteadyMotion::moved(const Eigen::Isometry3d& pose, double time_s) const {
  Eigen::Isometry3d result = pose;
  result.translation() += time_s * velocity_m_s;
  const double angle = angular_velocity_rad_s.norm() * time_s;
  if (angle != 0.0) {
    result.linear() =
        Eigen::AngleAxisd(angle, angular_velocity_rad_s.normalized()).toRotationMatrix() *
        pose.linear();
  }
  return result;
}

CameraModel Scene::pinhole(int width, int height, double fov_deg) {
  const double focal_px = 0.5 * width / std::tan(half_angle_rad(fov_deg, 180.0));
  return CameraModel(width, height, focal_px, focal_px, 0.5 * (width - 1), 0.5 * (height - 1));
}

CameraModel Scene::fisheye(int width, int height, double fov_deg) {
  const double focal_px = 0.5 * width / half_angle_rad(fov_deg, 180.0);
  return CameraModel(width, height, focal_px, focal_px, 0.5 * (width - 1), 0.5 * (height - 1),
                     LensModel::kEquidistant, {0.0, 0.0, 0.0, 0.0});
}

Scene Scene::flat_wall(double distance_m) {
  Scene scene;
  scene.name = "flat wall";
  SceneObject wall;
  wall.name = "wall";
  wall.T_world_object.translation().x() = distance_m;
  scene.objects.push_back(std::move(wall));
  return scene;
}

Eigen::Isometry3d Scene::T_device_cam() const {
  Eigen::Matrix3d axes;   // Columns: the camera's x, y, z on a device that it looks along.
  axes << 0.0, 0.0, 1.0,  //
      -1.0, 0.0, 0.0,     //
      0.0, -1.0, 0.0;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = camera_rotation * axes;
  return T;
}

bool Scene::is_static() const {
  if (!device_motion.is_still()) return false;
  for (const SceneObject& object : objects) {
    if (!object.motion.is_still()) return false;
  }
  return true;
}

}  // namespace striper
