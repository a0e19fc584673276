// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Dense>
#include <opencv2/core/mat.hpp>

#include <striper/board/board.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/model/camera_model.hpp>
#include <striper/model/laser_plane.hpp>

#include "support/random.hpp"

namespace striper::testing {

/// What a rendered board image holds besides the board.
struct BoardImageOptions {
  double black_dn = 40.0;
  double white_dn = 200.0;
  double background_dn = 110.0;
  double noise_dn = 0.0;
  double margin_squares = 1.0;  ///< White beyond the print.
  int samples = 6;              ///< Per pixel and axis.
  std::optional<LaserPlane> laser;
  double laser_dn = 180.0;      ///< Amplitude on white; black takes a fifth.
  double laser_width_px = 1.5;  ///< Gaussian sigma across: along columns (kColumns) or rows.
  StripeAxis laser_axis = StripeAxis::kColumns;
};

/// The reflectance of a board at a point of its plane: 1 white, 0 black, empty off the board.
inline std::optional<double> board_reflectance(const Board& board, const Eigen::Vector2d& p_m,
                                               double margin_squares) {
  const double x = p_m.x() / board.square_m;
  const double y = p_m.y() / board.square_m;
  const bool checkerboard = board.pattern == Board::Pattern::kCheckerboard;
  const double border = (checkerboard ? 1.0 : 0.5);
  const double out = border + margin_squares;
  if (x < -out || y < -out || x > board.columns - 1 + out || y > board.rows - 1 + out)
    return std::nullopt;
  if (!checkerboard) {
    const double dx = x - std::clamp(std::round(x), 0.0, board.columns - 1.0);
    const double dy = y - std::clamp(std::round(y), 0.0, board.rows - 1.0);
    return std::hypot(dx, dy) < 0.25 ? 0.0 : 1.0;
  }
  if (x < -1.0 || y < -1.0 || x > board.columns || y > board.rows) return 1.0;
  const auto parity = static_cast<int>(std::floor(x)) + static_cast<int>(std::floor(y));
  return parity % 2 == 0 ? 0.0 : 1.0;
}

/// The pixels in which a board can be, from the outline of its paper.
inline cv::Rect box_of_board(const CameraModel& camera, const Board& board,
                             const Eigen::Isometry3d& T_cam_board, double margin_squares) {
  const double out = board.print_border_m() + margin_squares * board.square_m;
  const Eigen::Vector2d low(-out, -out);
  const Eigen::Vector2d size = 2.0 * board.half_extent_m() - 2.0 * low;
  constexpr int kSteps = 16;
  Eigen::Vector2d first(camera.width(), camera.height());
  Eigen::Vector2d last(0.0, 0.0);
  for (int i = 0; i <= kSteps; ++i)
    for (int k = 0; k <= kSteps; ++k) {
      const Eigen::Vector2d p = low + size.cwiseProduct(Eigen::Vector2d(i, k) / kSteps);
      const auto at = camera.project(T_cam_board * Eigen::Vector3d(p.x(), p.y(), 0.0));
      if (at.status != CameraStatus::kOk) return {0, 0, camera.width(), camera.height()};
      first = first.cwiseMin(at.pixel);
      last = last.cwiseMax(at.pixel);
    }
  constexpr int kCurvaturePx = 8;  // Of an edge between two of the points.
  return cv::Rect(cv::Point(static_cast<int>(first.x()) - kCurvaturePx,
                            static_cast<int>(first.y()) - kCurvaturePx),
                  cv::Point(static_cast<int>(last.x()) + kCurvaturePx,
                            static_cast<int>(last.y()) + kCurvaturePx)) &
         cv::Rect(0, 0, camera.width(), camera.height());
}

/// Half a pixel along a stripe's profile.
inline Eigen::Vector2d half_pixel_across(StripeAxis axis) {
  return axis == StripeAxis::kColumns ? Eigen::Vector2d(0.0, 0.5) : Eigen::Vector2d(0.5, 0.0);
}

/// Renders a board by sampling every pixel: slow and plain, its pixel (0, 0) is the centre of the
/// top-left pixel by construction.
inline cv::Mat render_board(const CameraModel& camera, const Board& board,
                            const Eigen::Isometry3d& T_cam_board,
                            const BoardImageOptions& options = {}) {
  const Eigen::Isometry3d T_board_cam = T_cam_board.inverse();
  const Eigen::Vector3d centre = T_board_cam.translation();
  cv::Mat image(camera.height(), camera.width(), CV_8UC1);
  const cv::Rect box = box_of_board(camera, board, T_cam_board, options.margin_squares);
  for (int row = 0; row < image.rows; ++row)
    for (int column = 0; column < image.cols; ++column) {
      double sum = 0.0;
      const int n = box.contains({column, row}) ? options.samples : 1;
      for (int k = 0; k < n * n; ++k) {
        const int across = k % n;
        const int down = k / n;
        const Eigen::Vector2d pixel(column - 0.5 + (across + 0.5) / n,
                                    row - 0.5 + (down + 0.5) / n);
        const auto ray = camera.unproject(pixel);
        double value = options.background_dn;
        if (ray.status == CameraStatus::kOk) {
          const Eigen::Vector3d r_cam(ray.xy.x(), ray.xy.y(), 1.0);
          const Eigen::Vector3d r = T_board_cam.linear() * r_cam;
          const double along = -centre.z() / r.z();
          const Eigen::Vector2d p = (centre + along * r).head<2>();
          const auto white = board_reflectance(board, p, options.margin_squares);
          if (along > 0.0 && white) {
            value = options.black_dn + *white * (options.white_dn - options.black_dn);
            if (options.laser) {
              // Pixels to the laser plane along the axis, to first order.
              const auto height = [&](const Eigen::Vector2d& at) {
                const auto other = camera.unproject(at);
                const Eigen::Vector3d q =
                    T_board_cam.linear() * Eigen::Vector3d(other.xy.x(), other.xy.y(), 1.0);
                const double t = -centre.z() / q.z();
                return options.laser->normal().dot(
                           t * Eigen::Vector3d(other.xy.x(), other.xy.y(), 1.0)) -
                       options.laser->distance_m();
              };
              const double e = height(pixel);
              const Eigen::Vector2d half = half_pixel_across(options.laser_axis);
              const double slope = height(pixel + half) - height(pixel - half);
              const double off = e / slope / options.laser_width_px;
              value += (0.2 + 0.8 * *white) * options.laser_dn * std::exp(-0.5 * off * off);
            }
          }
        }
        sum += value;
      }
      const double noisy = sum / (n * n) + normal(0.0, options.noise_dn);
      image.at<std::uint8_t>(row, column) =
          static_cast<std::uint8_t>(std::clamp(std::lround(noisy), 0L, 255L));
    }
  return image;
}

}  // namespace striper::testing
