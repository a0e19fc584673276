// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <striper/core/stripe_axis.hpp>

namespace striper {

/// By how much the length of a laser plane's normal may be off 1.
inline constexpr double kUnitNormalTolerance = 1e-6;

/// The plane of laser light in the camera frame: `normal . p_cam = distance_m`, |normal| = 1,
/// distance_m >= 0. Thread-safe value.
class LaserPlane {
 public:
  LaserPlane() = default;

  /// Normalises the sign so that distance_m >= 0.
  /// @throws Error{kBadValue} where |normal| is off 1 by more than the tolerance, or a number is
  /// not finite.
  LaserPlane(const Eigen::Vector3d& normal, double distance_m);

  const Eigen::Vector3d& normal() const noexcept { return normal_; }
  double distance_m() const noexcept { return distance_m_; }

  /// Signed distance of a point from the plane, metres, positive on the side the normal points to.
  double signed_distance_m(const Eigen::Vector3d& p_cam) const noexcept {
    return normal_.dot(p_cam) - distance_m_;
  }

  friend bool operator==(const LaserPlane&, const LaserPlane&) = default;

 private:
  Eigen::Vector3d normal_ = Eigen::Vector3d::UnitY();
  double distance_m_ = 0.0;
};

/// Returns the standing frame of a laser plane, T_cam_scan: origin at the foot of the perpendicular
/// from the camera centre; x = the optical axis projected on the plane; z = the plane normal turned
/// so that it has a positive component along -y_cam (`kColumns`: y points left) or along +x_cam
/// (`kRows`: y points up); y = z cross x.
/// @throws Error{kBadValue} where the plane is perpendicular to the optical axis, or its normal has
/// no
///         component along the direction that decides the sign.
Eigen::Isometry3d standard_T_cam_scan(const LaserPlane& plane, StripeAxis axis);

/// Returns the homography from undistorted rays (x, y, 1) to (X, Y, 1) in the scan frame, scaled to
/// unit Frobenius norm with positive last row on rays that meet the plane in front of the camera:
/// p_cam = d r / (n . r), written in the frame T_cam_scan. Mertz et al. 2002 call it the homology
/// between the image plane and the laser plane.
Eigen::Matrix3d laser_homography(const LaserPlane& plane, const Eigen::Isometry3d& T_cam_scan);

}  // namespace striper
