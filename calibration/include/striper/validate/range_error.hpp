// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include <striper/model/striper_model.hpp>

namespace striper {

/// The predicted calibration error of a range.
struct RangeSigma {
  double range_m = 0.0;
  double sigma_m = 0.0;      ///< NaN where the range is not in the image.
  Eigen::Vector2d pixel;     ///< Where it is seen, straight ahead or as near to that as there is.
  bool inside_data = false;  ///< Within the depths at which the stripe was seen on the boards.
};

/// The predicted calibration error over the image, row by row.
struct RangeMap {
  int columns = 0;
  int rows = 0;
  std::vector<double> range_m;  ///< NaN where the ray does not meet the plane in front.
  std::vector<double> sigma_m;
};

/// The calibration error at some ranges. Precondition: the model has a covariance and the laser.
std::vector<RangeSigma> predict_range_sigma(const StriperModel& model, int laser,
                                            const std::vector<double>& ranges_m,
                                            double nearest_data_m, double farthest_data_m);
RangeMap range_map(const StriperModel& model, int laser, int columns, int rows);

}  // namespace striper
