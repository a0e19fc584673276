// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <striper/geometry/triangulator.hpp>

namespace striper::detail {

/// The one-sigma calibration error of a range, as a bilinear table over the sensor.
///
/// What is tabulated is sigma_cal * w^2 with w the homography's denominator (inversely proportional
/// to depth): range errors grow with the square of depth, so this hardly changes from node to node.
/// Within 1 % of Triangulator::sigma_cal_m where the laser plane is in view.
class CalibrationSigmaTable {
 public:
  explicit CalibrationSigmaTable(const Triangulator& triangulator);

  /// @param w the last element of homography * (x, y, 1) at that pixel.
  /// Returns NaN where the model has no covariance or the sensor is left.
  double sigma_m(double u_px, double v_px, double w) const noexcept;

 private:
  std::size_t at(int column, int row) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  double from_known_corners(const double* corner, double fs, double ft) const noexcept;

  int columns_ = 0;
  int rows_ = 0;
  std::vector<double> scaled_;
};

}  // namespace striper::detail
