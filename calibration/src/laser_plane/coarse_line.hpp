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
  std::vector<char> clipped;  ///< The converter ended below the stripe's peak.
};

/// @param seen where the extractor may look, 255. @param worst which returns count.
Returns returns_within(const cv::Mat& seen, const LaserImage& image, const CameraModel& camera,
                       const ExtractionSettings& settings, StripeExtractor& extractor,
                       Verdict worst);

double median_of(const std::vector<float>& values, const std::vector<std::size_t>& some);

/// How wide the stripe is: the median of some of the returns, of those that are not clipped; empty
/// where these are too few. A clipped profile has lost its top, and its width with it: a stripe of
/// pixels at full scale comes out half as wide again as it is, and every fit with that width puts
/// it off by up to a tenth of a pixel.
std::optional<double> unclipped_width_px(const Returns& returns,
                                         const std::vector<std::size_t>& some);

/// The stripe on a board as its brightest pixels have it.
struct CoarseLine {
  BoardStripe stripe;  ///< Without points; says why where there is none.
  Returns returns;
  StraightLine line;
  cv::Mat mask;  ///< Of the board, 255.
};

CoarseLine find_coarse_line(const LaserImage& image, const Board& board, const CameraModel& camera,
                            const ExtractionSettings& settings,
                            const std::optional<NoiseModel>& noise);

}  // namespace striper::detail
