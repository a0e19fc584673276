// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <striper/core/channel.hpp>
#include <striper/core/noise_model.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/model/camera_model.hpp>
#include <striper/model/laser_plane.hpp>
#include <striper/model/stripe_look.hpp>

namespace striper {

/// One laser of the striper.
struct Laser {
  LaserPlane plane;
  std::optional<Eigen::Matrix3d> homography;  ///< As the file gave it; checked against the plane.
  std::optional<Eigen::Isometry3d> moved_T_cam_scan;  ///< Where the file moves the scan frame.
  StripeLook look{};                                  ///< What its stripe looks like.
};

/// The joint covariance of everything that enters a range. A plane has 3 degrees of freedom, so its
/// 4x4 block (laser0_nx, laser0_ny, laser0_nz, laser0_d) has rank 3.
struct ModelCovariance {
  std::vector<std::string> parameters;  ///< fx, fy, cx, cy, k1, ..., laser0_nx, ..., laser0_d, ...
  Eigen::MatrixXd matrix;  ///< Symmetric, positive semi-definite, parameters.size() squared.
};

/// A calibrated striper: camera, laser planes, how the stripe runs, and how well all of it is
/// known.
///
/// A plain value that `load_model` fills and checks; `validate` does the same for one made in code.
struct StriperModel {
  CameraModel camera;
  std::vector<Laser> lasers;  ///< May be empty: a camera alone.
  StripeAxis axis = StripeAxis::kColumns;
  Channel channel = Channel::kGrey;  ///< For frames that are searched as they are.
  std::optional<Channel>
      difference_channel;  ///< Where a dark exposure is subtracted; else channel.
  std::optional<NoiseModel> noise;
  std::optional<ModelCovariance> covariance;
  std::string quality_yaml;  ///< The `quality:` block as YAML text, kept as it is; empty if none.

  /// The scan frame of a laser: as moved by the file, else the standing one.
  /// @throws Error{kBadValue} where there is no such laser.
  Eigen::Isometry3d T_cam_scan(int laser) const;

  /// @throws Error{kBadValue} naming the field, the value and what was expected.
  void validate() const;
};

}  // namespace striper
