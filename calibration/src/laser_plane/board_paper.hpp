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

/// How far beyond the print the paper may go on, in squares.
inline constexpr double kMarginSquares = 3.0;

/// Where the stripe is in an image, so that its light is not taken for the paper's.
struct StripeCourse {
  StripeAxis axis = StripeAxis::kColumns;
  std::vector<double> across;  ///< In each column (kColumns) or row; NaN: not there.
  double reach_px = 0.0;       ///< How far from it light of the laser is seen.
};

/// How far the white paper around the print goes, in the board's frame: on each side of the print
/// to where the image is no longer as bright as the white squares beside it, at most
/// `kMarginSquares`. Behind the paper's end is another albedo, which pulls a stripe as any black
/// square does, by up to a tenth of a pixel, and the same way in all images of a session that
/// show the board's lower end.
/// @param grey of the board, CV_8U; may show the stripe. Cost ~1 ms.
Eigen::AlignedBox2d find_paper(const cv::Mat& grey, const Board& board, const CameraModel& camera,
                               const Eigen::Isometry3d& T_cam_board, const StripeCourse& stripe);

}  // namespace striper::detail
