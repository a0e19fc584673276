// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace striper::detail {

/// A checkerboard corner as it looks in the image: two blurred edges that cross,
/// B + slope . (p - c) + A erf(d1 / (sqrt2 s)) erf(d2 / (sqrt2 s)) with d the distances to the
/// edges.
struct CornerModel {
  Eigen::Vector2d centre_px;
  double edge1_rad = 0.0;  ///< Directions of the edges' normals.
  double edge2_rad = 0.0;
  double amplitude_dn = 0.0;
  double blur_px = 1.0;      ///< Gaussian sigma of the edges, pixel box included.
  double residual_dn = 0.0;  ///< rms of what the model leaves.
};

/// Fits the model by damped Gauss-Newton within `radius_px`.
///
/// The pattern and the model are both symmetric about the corner, so that blur, angle and shading
/// leave its position unbiased, where the usual gradient-orthogonality refinement
/// (cv::cornerSubPix) is off by 0.05 to 0.1 px. Empty where it does not converge near the start.
/// @param grey CV_8UC1. @param along, down the board's axes in the image at the corner.
std::optional<CornerModel> fit_corner(const cv::Mat& grey, const Eigen::Vector2d& start_px,
                                      const Eigen::Vector2d& along, const Eigen::Vector2d& down,
                                      double radius_px);

}  // namespace striper::detail
