// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
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

/// An image with the stripe on the board, the same without where there is one, and where the board
/// is in it.
struct LaserImage {
  std::string name;
  cv::Mat on;
  cv::Mat off;  ///< Empty: board and stripe are in one image.
  int bit_depth = 8;
  Eigen::Isometry3d T_cam_board = Eigen::Isometry3d::Identity();
};

/// How the stripe is read out of an image.
struct ExtractionSettings {
  StripeAxis axis = StripeAxis::kColumns;
  Channel channel = Channel::kGrey;
  bool subtract_off = false;  ///< Lit minus dark image, where there is one.

  friend bool operator==(const ExtractionSettings&, const ExtractionSettings&) = default;
};

std::string to_string(const ExtractionSettings& settings);

/// One return on the board, for what the stripe looks like.
struct StripeSample {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  float width_px = 0.0F;
  float amplitude_dn = 0.0F;
  bool is_clipped = false;  ///< A pixel of it is at full scale: it was brighter.
  bool is_white = false;    ///< On a white square or the white margin.
};

/// The stripe on the board of one image.
struct BoardStripe {
  std::vector<Eigen::Vector2d> pixel;      ///< Neighbouring returns averaged: 120 at most.
  std::vector<double> sigma_px;            ///< Across the stripe.
  std::vector<Eigen::Vector2d> return_px;  ///< The returns that were averaged, each by itself.
  std::vector<StripeSample> samples;       ///< The same, with what they look like.
  /// Shares of blue, green and red in the stripe's light, of an image in colour.
  std::optional<std::array<double, 3>> colour;
  int returns = 0;            ///< What the extractor found on the board.
  int on_line = 0;            ///< Of these, on one straight line.
  int at_albedo_edge = 0;     ///< Of these, left out since black meets white under the stripe.
  double line_rms_px = 0.0;   ///< Scatter of the kept returns about the line.
  double amplitude_dn = 0.0;  ///< Median.
  double width_px = 0.0;      ///< Median Gaussian sigma.
  std::string reason;         ///< Why there is none, for people; empty where there is one.

  bool found() const noexcept { return reason.empty(); }
};

/// Finds the stripe on the board and on the white margin around its print: nothing else in the
/// image can mislead it, since a mask from the board's pose keeps the extractor from the rest.
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
/// @param noise of the camera; empty: estimated from the image. Thread-safe.
BoardStripe find_board_stripe(const LaserImage& image, const Board& board,
                              const CameraModel& camera, const ExtractionSettings& settings,
                              const std::optional<NoiseModel>& noise = std::nullopt);

/// The ways of reading the stripe that show one in some image, each list the best first
/// impression first.
struct SettingsRanking {
  std::vector<ExtractionSettings> plausible;  ///< Of each kind (laser-off image subtracted or not)
                                              ///< the best four, where not far behind the best.
  std::vector<ExtractionSettings> others;
};

/// Tries every way of reading the stripe on some of the images, and ranks them by how well their
/// lines are known (scatter over the root of the number of returns). A colour difference that
/// hollows out a stripe clipped to white, or a grey image of a white board, comes last by itself.
/// Which of them to take, the planes through the stripes of all images tell.
/// @param axis, channel given by the user, or empty (or kAuto) to be chosen.
/// @throws Error{kUntrustworthy} where no way shows a stripe in any image.
SettingsRanking rank_settings(const std::vector<LaserImage>& images, const Board& board,
                              const CameraModel& camera, std::optional<StripeAxis> axis,
                              Channel channel);

/// Returns the mask (255) of the board and `margin_squares` around its print, as the pose has it.
cv::Mat board_mask(const Board& board, const CameraModel& camera,
                   const Eigen::Isometry3d& T_cam_board, double margin_squares);

}  // namespace striper
