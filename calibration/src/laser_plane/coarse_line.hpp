// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include <striper/core/return_status.hpp>
#include <striper/laser_plane/board_stripe.hpp>
#include <striper/stripe/extractor.hpp>

#include "laser_plane/straight_line.hpp"

namespace striper::detail {

/// What an extractor found, with the rays; parallel arrays.
struct Returns {
  std::vector<Eigen::Vector2d> pixel;
  std::vector<Eigen::Vector2d>
      undistorted;  ///< (along, across) in pixels of a lens without distortion.
  std::vector<double> sigma_px;
  std::vector<float> amplitude_dn;
  std::vector<float> width_px;
};

/// @param seen where the extractor may look, 255. @param worst which returns count.
Returns returns_within(const cv::Mat& seen, const LaserPicture& picture, const CameraModel& camera,
                       const StripeRecipe& recipe, StripeExtractor& extractor, Verdict worst);

double median(std::vector<float> values);

/// Of the returns on the line.
double median_width_px(const Returns& returns, const StraightLine& line);

/// The stripe on a board as its brightest pixels have it.
struct CoarseLine {
  BoardStripe stripe;  ///< Without points; says why where there is none.
  Returns returns;
  StraightLine line;
  cv::Mat mask;  ///< Of the board, 255.
};

CoarseLine find_coarse_line(const LaserPicture& picture, const Board& board,
                            const CameraModel& camera, const StripeRecipe& recipe,
                            const std::optional<NoiseModel>& noise);

}  // namespace striper::detail
