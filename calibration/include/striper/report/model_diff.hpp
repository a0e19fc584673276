// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <striper/model/striper_model.hpp>

namespace striper {

/// Where two models put the same pixel.
struct PixelDifference {
  Eigen::Vector2d pixel;
  double range_m = 0.0;       ///< By the first model.
  double difference_m = 0.0;  ///< Second minus first, range.
  double apart_m = 0.0;       ///< Distance of the two points in the camera frame.
  double sigma_m = std::numeric_limits<double>::quiet_NaN();  ///< Both calibrations' errors
                                                              ///< together; NaN without.
};

/// How two models of a striper differ, over the image.
struct ModelDifference {
  std::vector<PixelDifference> pixels;  ///< On a grid, row by row, where both models have a range.
  double rms_m = 0.0;                   ///< Of the range differences.
  double worst_m = 0.0;
  PixelDifference worst;
  /// rms of difference over sigma; about 1 or less where the error bars explain it. NaN without.
  double rms_sigmas = std::numeric_limits<double>::quiet_NaN();
};

/// Compares two models of the same camera and laser: for drift between two calibrations.
/// @param farthest_m pixels whose range by the first model is beyond it are left out.
/// @throws Error{kBadValue} where image sizes differ or a model lacks the laser.
ModelDifference compare_models(const StriperModel& first, const StriperModel& second, int laser,
                               double farthest_m = 10.0, int columns = 32, int rows = 24);

}  // namespace striper
