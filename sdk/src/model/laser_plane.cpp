// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/model/laser_plane.hpp>

#include "model/scan_frame.hpp"

namespace striper {
namespace {

// Sine of the angle below which a direction is too near square to decide anything: 0.2 arc seconds.
constexpr double kDecisive = 1e-6;

std::string text(const Eigen::Vector3d& v) {
  return fmt::format("[{}, {}, {}]", v.x(), v.y(), v.z());
}

}  // namespace

LaserPlane::LaserPlane(const Eigen::Vector3d& normal, double distance_m)
    : normal_(distance_m < 0.0 ? Eigen::Vector3d(Eigen::Vector3d::Zero() - normal) : normal),
      distance_m_(std::abs(distance_m)) {
  if (!(std::abs(normal.norm() - 1.0) <= kUnitNormalTolerance)) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("laser plane: normal is {}, of length {} - expected length 1 to {}",
                            text(normal), normal.norm(), kUnitNormalTolerance));
  }
  if (!std::isfinite(distance_m)) {
    throw Error(
        ErrorKind::kBadValue,
        fmt::format("laser plane: distance is {} m - expected a finite number", distance_m));
  }
}

namespace detail {

std::optional<ScanFrameObstacle> find_obstacle(const LaserPlane& plane, StripeAxis axis) {
  const Eigen::Vector3d& n = plane.normal();
  if (std::hypot(n.x(), n.y()) < kDecisive) {
    return ScanFrameObstacle{
        fmt::format("{}, along the optical axis", text(n)),
        "a plane that the camera looks along, so that its scan frame has an x axis"};
  }
  const bool is_columns = axis == StripeAxis::kColumns;
  if (std::abs(is_columns ? n.y() : n.x()) < kDecisive) {
    return ScanFrameObstacle{
        fmt::format("{}, without a component along {}", text(n), is_columns ? "y" : "x"),
        fmt::format("a plane across the search direction of stripe axis {}; is it the other axis?",
                    to_string(axis))};
  }
  return std::nullopt;
}

}  // namespace detail

Eigen::Isometry3d standard_T_cam_scan(const LaserPlane& plane, StripeAxis axis) {
  if (const auto obstacle = detail::find_obstacle(plane, axis)) {
    throw Error(ErrorKind::kBadValue, fmt::format("laser plane: normal is {} - expected {}",
                                                  obstacle->value, obstacle->expected));
  }
  const Eigen::Vector3d n = plane.normal().normalized();
  const Eigen::Vector3d x = Eigen::Vector3d::UnitZ() - n.z() * n;
  const double up = axis == StripeAxis::kColumns ? -n.y() : n.x();
  Eigen::Isometry3d T_cam_scan = Eigen::Isometry3d::Identity();
  T_cam_scan.linear().col(0) = x.normalized();
  T_cam_scan.linear().col(2) = up > 0.0 ? n : Eigen::Vector3d(-n);
  T_cam_scan.linear().col(1) = T_cam_scan.linear().col(2).cross(T_cam_scan.linear().col(0));
  T_cam_scan.translation() = plane.normal() * plane.distance_m() / plane.normal().squaredNorm();
  return T_cam_scan;
}

Eigen::Matrix3d laser_homography(const LaserPlane& plane, const Eigen::Isometry3d& T_cam_scan) {
  // X = x_axis . (d r / (n . r) - origin), and the same for Y; times n . r that is linear in r.
  const Eigen::RowVector3d n = plane.normal().transpose();
  Eigen::Matrix3d H;
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector3d axis = T_cam_scan.linear().col(i);
    H.row(i) = plane.distance_m() * axis.transpose() - axis.dot(T_cam_scan.translation()) * n;
  }
  H.row(2) = n;
  return H / H.norm();
}

}  // namespace striper
