// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include <striper/model/camera_model.hpp>

namespace striper {

/// A camera that is known beforehand, from `--intrinsics`.
struct KnownCamera {
  CameraModel camera;
  /// Of its parameters; empty: its error is unknown. The camera is held as it is all the same.
  std::optional<Eigen::MatrixXd> covariance;
};

}  // namespace striper
