// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <striper/board/board.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper {

/// The board's points in one image. Points that were rejected are left out, so `point` says which
/// board point each pixel is.
struct CornerView {
  std::string name;  ///< Of the image, for messages and the report.
  std::vector<int> point;
  std::vector<Eigen::Vector2d> pixel;  ///< Full-sensor pixels.
};

/// The stripe of one laser on the board of one image (or pair of images).
struct StripeView {
  std::string name;
  int view = 0;                        ///< Index of the CornerView that has this board's pose.
  int laser = 0;                       ///< Index of the laser.
  std::vector<Eigen::Vector2d> pixel;  ///< Full-sensor pixels.
  std::vector<double> sigma_px;        ///< Across the stripe (along v for kColumns, u for kRows).

  /// Gaussian sigma of the stripe's profile, and of what the thickness of the laser plane alone
  /// would give without the lens' blur: a wide stripe on a sloping board is found beside the middle
  /// of the laser plane, and the adjustment predicts by how much. 0: it is taken to be found in the
  /// middle.
  double width_px = 0.0;
  double thickness_px = 0.0;
};

/// All that a calibration is computed from: points alone, no images.
struct Observations {
  Board board;
  int image_width = 0;
  int image_height = 0;
  StripeAxis axis = StripeAxis::kColumns;
  std::vector<CornerView> views;
  std::vector<StripeView> stripes;

  /// One more than the largest laser index; 0 without stripes.
  int laser_count() const noexcept;

  /// Returns the observations of some of the views only, with their stripes, renumbered. The lasers
  /// keep their indices.
  Observations subset(const std::vector<int>& view_indices) const;

  /// @throws Error{kBadValue} naming the view and the quantity, where an index, a size or a number
  /// is impossible.
  void validate() const;
};

}  // namespace striper
