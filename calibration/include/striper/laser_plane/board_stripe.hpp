// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core/mat.hpp>

#include <striper/board/board.hpp>
#include <striper/core/channel.hpp>
#include <striper/core/noise_model.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/model/camera_model.hpp>

namespace striper {

/// A picture with the stripe on the board, the same without where there is one, and where the board
/// is in it.
struct LaserPicture {
  std::string name;
  cv::Mat on;
  cv::Mat off;  ///< Empty: board and stripe are in one picture.
  int bit_depth = 8;
  Eigen::Isometry3d T_cam_board = Eigen::Isometry3d::Identity();
};

/// How the stripe is read out of a picture.
struct StripeRecipe {
  StripeAxis axis = StripeAxis::kColumns;
  Channel channel = Channel::kGrey;
  bool subtract_off = false;  ///< Lit minus dark picture, where there is one.

  friend bool operator==(const StripeRecipe&, const StripeRecipe&) = default;
};

std::string to_string(const StripeRecipe& recipe);

/// The stripe on the board of one picture.
struct BoardStripe {
  std::vector<Eigen::Vector2d> pixel;      ///< Neighbouring returns averaged: 120 at most.
  std::vector<double> sigma_px;            ///< Across the stripe.
  std::vector<Eigen::Vector2d> return_px;  ///< The returns that were averaged, each by itself.
  int returns = 0;                         ///< What the extractor found on the board.
  int on_line = 0;                         ///< Of these, on one straight line.
  int at_albedo_edge = 0;     ///< Of these, left out since black meets white under the stripe.
  double line_rms_px = 0.0;   ///< Scatter of the kept returns about the line.
  double amplitude_dn = 0.0;  ///< Median.
  double width_px = 0.0;      ///< Median Gaussian sigma.
  std::string reason;         ///< Why there is none, for people; empty where there is one.

  bool found() const noexcept { return reason.empty(); }
};

/// Finds the stripe on the board and on the white margin around its print: nothing else in the
/// picture can mislead it, since a mask from the board's pose blinds the extractor to the rest.
///
/// A laser plane meets a board in a straight line, so the returns are first brought to a robust
/// line (least median of squares, in undistorted pixels) and what is off it, such as a specular
/// blob, is dropped. A return whose profile straddles black and white is dropped too: an albedo
/// step shifts every estimator, by up to 0.8 of the stripe's sigma.
///
/// The line is first found by the brightest pixels (method `paper`), then its points by the method
/// `refined` on the ground along it that has one albedo in each column. On the whole board that
/// method would take white squares among black ones for peaks, learn their width for the stripe's,
/// and put its background across the edges. Where too little even ground is left, the points are
/// those of the first pass, with their larger sigmas.
/// @param noise of the camera; empty: estimated from the picture. Cost 5 to 50 ms. Thread-safe.
BoardStripe find_board_stripe(const LaserPicture& picture, const Board& board,
                              const CameraModel& camera, const StripeRecipe& recipe,
                              const std::optional<NoiseModel>& noise = std::nullopt);

/// Chooses how the stripe is read by trying every way on some of the pictures: the one whose lines
/// are known best (scatter over the root of the number of returns) wins. A colour difference that
/// hollows out a line clipped to white, or a grey picture of a white board, loses by itself.
/// @param axis, channel given by the user, or empty (or kAuto) to be chosen.
/// @throws Error{kUntrustworthy} where no way shows a line in any picture.
StripeRecipe choose_recipe(const std::vector<LaserPicture>& pictures, const Board& board,
                           const CameraModel& camera, std::optional<StripeAxis> axis,
                           Channel channel);

/// Returns the mask (255) of the board and `margin_squares` around its print, as the pose has it.
cv::Mat board_mask(const Board& board, const CameraModel& camera,
                   const Eigen::Isometry3d& T_cam_board, double margin_squares);

}  // namespace striper
