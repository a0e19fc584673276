// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <striper/model/striper_model.hpp>

namespace striper::detail {

/// What is wrong with a model, in the words of the model file.
struct Violation {
  std::string field;  ///< `lasers[0].homography`: a path into the file.
  std::string value;
  std::string expected;
};

/// Finds the first thing about a model that does not fit together; what its parts check when they
/// are made (`CameraModel`, `LaserPlane`) is not repeated.
std::optional<Violation> find_violation(const StriperModel& model);

/// Every name that the covariance of this model may have: the camera's parameters, then laser0_nx,
/// laser0_ny, laser0_nz, laser0_d, laser1_nx, ...
std::vector<std::string> known_parameters(const StriperModel& model);

}  // namespace striper::detail
