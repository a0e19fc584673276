// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// A circle through returns.
struct CircleFit {
  Eigen::Vector3d parameters = Eigen::Vector3d::Zero();  ///< Centre x, y (scan frame) and radius.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  int points = 0;
  bool is_determined = false;
};

/// Fits a circle by weighted least squares of the distances from it, to which the noise along each
/// ray is projected; what is still far off is left out. Where the arc turns away from the camera
/// the projection is small and the weight is bounded, so the covariance is the estimator's own
/// (Huber's sandwich). Started from the algebraic fit (Kasa 1976).
CircleFit fit_circle(const InverseRanges& ranges, std::vector<std::size_t> elements);

}  // namespace striper::detail
