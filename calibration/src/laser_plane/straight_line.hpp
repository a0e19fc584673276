// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace striper::detail {

/// y = offset + slope x, and who is on it.
struct StraightLine {
  double offset = 0.0;
  double slope = 0.0;
  double rms = 0.0;  ///< Of the inliers.
  std::vector<std::size_t> inliers;

  double at(double x) const noexcept { return offset + slope * x; }
};

/// Fits a line to points most of which are on one: least median of squares over random pairs
/// (Rousseeuw 1984, always the same draws), then least squares on what is within three robust
/// sigmas, not less than `least_gate`. Empty for fewer than eight points.
std::optional<StraightLine> fit_line(const std::vector<Eigen::Vector2d>& points, double least_gate);

}  // namespace striper::detail
