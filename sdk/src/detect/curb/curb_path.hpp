// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include <striper/detect/curb_detector.hpp>

#include "track/kalman.hpp"

namespace striper::detail {

/// Where a curb is along the way: Kalman filters of lateral distance with slope, and of height.
class CurbPath {
 public:
  void start(const CurbFinding& seen, const CurbDetectorOptions& options) noexcept;
  /// Foretells it a way later. @param turn_rad that the vehicle turned by.
  void predict(double way_m, double turn_rad, const CurbDetectorOptions& options) noexcept;
  /// Chi-square, 2 degrees of freedom, of a finding being this curb.
  double distance2(const CurbFinding& seen, const CurbDetectorOptions& options) const noexcept;
  void update(const CurbFinding& seen, const CurbDetectorOptions& options) noexcept;

  double lateral_m() const noexcept { return path_.mean[0]; }
  double sigma_lateral_m() const noexcept;
  double slope() const noexcept { return path_.mean[1]; }
  double sigma_slope() const noexcept;
  double height_m() const noexcept { return height_m_; }
  double sigma_height_m() const noexcept;

 private:
  KalmanState<2> path_{Eigen::Vector2d::Zero(), Eigen::Matrix2d::Zero()};
  double height_m_ = 0.0;
  double height_variance_ = 0.0;
};

}  // namespace striper::detail
