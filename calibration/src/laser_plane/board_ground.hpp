// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core/mat.hpp>

#include <striper/board/board.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/model/camera_model.hpp>

namespace striper::detail {

/// How far beyond the print the board may go on, in squares.
inline constexpr double kMarginSquares = 3.0;

/// What lies on the board's plane in a picture.
struct BoardInPicture {
  const Board& board;
  const CameraModel& camera;
  Eigen::Isometry3d T_board_cam;
};

/// True where black meets white within `reach_px` of a pixel along the stripe's profile.
bool straddles_albedo_edge(const BoardInPicture& scene, const Eigen::Vector2d& pixel,
                           StripeAxis axis, double reach_px);

/// The pixels along a line, 255, whose albedo is the one under the line in their own column
/// (kColumns) or row, black meeting white nowhere within two pixels of them. Where it does within
/// `reach_px` of the line, no pixel of the column.
/// @param across where the line is in each column (kColumns) or row; NaN: not there.
/// @param half_px how far from the line.
cv::Mat even_ground(const BoardInPicture& scene, const std::vector<double>& across, StripeAxis axis,
                    double half_px, double reach_px);

}  // namespace striper::detail
