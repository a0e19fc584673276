// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace striper::detail {

/// A dark dot of a grid of circles as it looks in the image.
struct DotImage {
  Eigen::Vector2d centre_px;    ///< Of its area, which is not where the circle's centre is seen.
  double radius_squares = 0.0;  ///< Of a circle with this area, in spacings of the grid.
};

/// Weighs the pixels of a dot's cell by how dark they are against the white around it, which may
/// be shaded: blur moves neither the centre of that weight nor its sum. Empty where there is no dot
/// on white there.
/// @param grey CV_8UC1. @param along, down the grid's axes in the image, per spacing.
std::optional<DotImage> measure_dot(const cv::Mat& grey, const Eigen::Vector2d& start_px,
                                    const Eigen::Vector2d& along, const Eigen::Vector2d& down);

}  // namespace striper::detail
