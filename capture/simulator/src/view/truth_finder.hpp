// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/core/pixel_grid.hpp>
#include <striper/simulator/truth.hpp>

#include "light/beam.hpp"
#include "view/view.hpp"

namespace striper::detail {

/// What the truth of one exposure is found from.
struct TruthInput {
  const View& view;
  const Beam& beam;
  int laser;
  PixelGrid grid;       ///< Of the exposure's own image.
  cv::Size image_size;  ///< Of the same.
  cv::Mat daylight;     ///< Electrons per sensor pixel of the region, with all blur.
  cv::Mat laser_light;  ///< The same of the laser.
};

/// Finds, in every scan line of an exposure's image, where the middle of the laser plane is on the
/// surfaces that the camera sees.
///
/// Each scan line is searched in steps of a pixel for a change of side of the laser plane; each
/// change is solved on the exact lens, surface and laser plane to 1e-10 px.
std::vector<TrueLine> find_truth(const TruthInput& input);

}  // namespace striper::detail
