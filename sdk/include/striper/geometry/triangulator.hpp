// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <striper/core/return_status.hpp>
#include <striper/model/striper_model.hpp>

namespace striper {

/// A point of the laser plane in the scan frame. NaN unless `status` is kOk.
struct PlanePoint {
  double x_m;
  double y_m;
  ReturnStatus status;  ///< kOk, kBehind or kOutsideModel.

  double range_m() const noexcept { return std::hypot(x_m, y_m); }
  double bearing_rad() const noexcept { return std::atan2(y_m, x_m); }
};

/// First derivatives of one triangulated point: rows x_m, y_m of the scan frame.
struct TriangulationGradient {
  Eigen::Matrix2d d_pixel;                            ///< By (u, v), metres per pixel.
  Eigen::Matrix<double, 2, Eigen::Dynamic> d_camera;  ///< By CameraModel::parameters().
  Eigen::Matrix<double, 2, 4> d_plane;                ///< By nx, ny, nz, d of the laser plane.
};

/// Triangulates pixels with one laser plane, and back: exact and straightforward, the oracle for
/// the fast tables.
///
/// p_cam = d r / (n . r) for the undistorted ray r = (x, y, 1); written in the scan frame this is a
/// homography (Mertz et al. 2002, "From image to distance"). With the camera straight above the
/// laser by s it is the paper's d = s cot(alpha). Immutable; thread-safe.
class Triangulator {
 public:
  /// @throws Error{kBadValue} where the model has no such laser or its plane passes through the
  /// camera.
  Triangulator(const StriperModel& model, int laser);

  /// About 200 ns, most of it the lens; no allocation.
  PlanePoint triangulate(const Eigen::Vector2d& pixel) const noexcept;

  /// The same from an undistorted ray (x, y, 1). About 2 ns.
  PlanePoint triangulate_ray(const Eigen::Vector2d& xy) const noexcept;

  /// The inverse: the pixel that sees a point of the laser plane.
  Projection project(double x_m, double y_m) const noexcept;

  /// Differentiates, the scan frame's own origin and axes (which the plane carries along) included.
  /// Precondition: triangulate(pixel).status is kOk. Allocates.
  TriangulationGradient gradient(const Eigen::Vector2d& pixel) const;

  /// Returns the one-sigma range error at a pixel from the model's covariance: sqrt(g' C g) over
  /// camera and plane. NaN where the model has none. Allocates.
  double sigma_cal_m(const Eigen::Vector2d& pixel) const;
  bool has_covariance() const noexcept { return covariance_.size() > 0; }
  /// Over CameraModel::parameters() and nx, ny, nz, d of the plane; empty where the model has none.
  const Eigen::MatrixXd& covariance() const noexcept { return covariance_; }

  const CameraModel& camera() const noexcept { return camera_; }
  const LaserPlane& plane() const noexcept { return plane_; }
  const Eigen::Isometry3d& T_cam_scan() const noexcept { return T_cam_scan_; }

  /// From (x, y, 1) to (X, Y, 1); the last row is positive on rays that meet the plane in front.
  const Eigen::Matrix3d& homography() const noexcept { return homography_; }

 private:
  CameraModel camera_;
  LaserPlane plane_;
  StripeAxis axis_;
  Eigen::Isometry3d T_cam_scan_;
  Eigen::Isometry3d
      T_standing_scan_;  // From the scan frame to the standing one; usually the identity.
  Eigen::Matrix3d homography_;
  Eigen::MatrixXd covariance_;  // Over (camera parameters, nx, ny, nz, d); empty if there is none.
};

}  // namespace striper
