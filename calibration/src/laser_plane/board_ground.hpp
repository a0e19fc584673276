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

/// What lies on the board's plane in an image.
struct BoardInImage {
  const Board& board;
  const CameraModel& camera;
  Eigen::Isometry3d T_board_cam;
  Eigen::AlignedBox2d paper_m;  ///< How far its paper goes, board frame.
};

/// True where black of the print meets white within `reach_px` of a pixel along the stripe's
/// profile.
bool straddles_albedo_edge(const BoardInImage& scene, const Eigen::Vector2d& pixel, StripeAxis axis,
                           double reach_px);

/// True on a white square of the print or on the white paper around it.
bool is_on_white(const BoardInImage& scene, const Eigen::Vector2d& pixel);

/// How much of a profile must lie on ground of one albedo.
struct ProfileGround {
  double same_px;   ///< No black where white is (or the other way) this far from the line,
  double clear_px;  ///< and no edge of black and white, or of the paper, within two pixels of what
                    ///< is this far from the line: half a profile comes out askew.
  double far_px;    ///< How far from the line pixels are wanted at all, for the background.
};

/// The pixels along a line, 255, whose albedo is the one under the line in their own column
/// (kColumns) or row, no black meeting white and no end of the paper within two pixels of them.
/// None of a column whose profile is not on such ground.
/// @param across where the line is in each column (kColumns) or row; NaN: not there.
cv::Mat even_ground(const BoardInImage& scene, const std::vector<double>& across, StripeAxis axis,
                    const ProfileGround& profile);

}  // namespace striper::detail
