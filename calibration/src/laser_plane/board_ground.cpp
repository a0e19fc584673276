// SPDX-License-Identifier: Apache-2.0
#include "laser_plane/board_ground.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <opencv2/imgproc.hpp>

#include <striper/laser_plane/board_stripe.hpp>

namespace striper {
namespace detail {
namespace {

constexpr std::uint8_t kUnknown = 2;

// How much light a point of the board's plane sends back: 1 white, 0 black; white off the print and
// unknown off the paper.
int albedo(const BoardInImage& scene, const Eigen::Vector2d& p_m) {
  const Board& board = scene.board;
  if (!scene.paper_m.contains(p_m)) return kUnknown;
  const double x = p_m.x() / board.square_m;
  const double y = p_m.y() / board.square_m;
  if (board.pattern == Board::Pattern::kCircles) {
    const double dx = x - std::clamp(std::round(x), 0.0, board.columns - 1.0);
    const double dy = y - std::clamp(std::round(y), 0.0, board.rows - 1.0);
    return std::hypot(dx, dy) < board.dot_ratio + 0.05 ? 0 : 1;
  }
  if (x < -1.0 || y < -1.0 || x > board.columns || y > board.rows) return 1;
  const int parity = static_cast<int>(std::floor(x)) + static_cast<int>(std::floor(y));
  return parity & 1;
}

// Where a pixel's ray meets the board's plane; empty behind the camera.
std::optional<Eigen::Vector2d> on_board(const BoardInImage& scene, const Eigen::Vector2d& pixel) {
  const Unprojection ray = scene.camera.unproject(pixel);
  if (ray.status != CameraStatus::kOk) return std::nullopt;
  const Eigen::Vector3d centre = scene.T_board_cam.translation();
  const Eigen::Vector3d r =
      scene.T_board_cam.linear() * Eigen::Vector3d(ray.xy.x(), ray.xy.y(), 1.0);
  const double along = -centre.z() / r.z();
  if (!(along > 0.0)) return std::nullopt;
  return Eigen::Vector2d((centre + along * r).head<2>());
}

// What the board is at the pixels within `half_px` of the line: 1 white, 0 black, or kUnknown.
cv::Mat ground_along(const BoardInImage& scene, const std::vector<double>& across, StripeAxis axis,
                     double half_px) {
  cv::Mat ground(scene.camera.height(), scene.camera.width(), CV_8UC1, cv::Scalar(kUnknown));
  const bool columns = axis == StripeAxis::kColumns;
  const int length = columns ? scene.camera.height() : scene.camera.width();
  for (std::size_t k = 0; k < across.size(); ++k) {
    if (!std::isfinite(across[k])) continue;
    const int first = std::max(0, static_cast<int>(std::floor(across[k] - half_px)));
    const int last = std::min(length - 1, static_cast<int>(std::ceil(across[k] + half_px)));
    for (int at = first; at <= last; ++at) {
      const cv::Point pixel =
          columns ? cv::Point(static_cast<int>(k), at) : cv::Point(at, static_cast<int>(k));
      const auto p = on_board(scene, {pixel.x, pixel.y});
      if (p) ground.at<std::uint8_t>(pixel) = static_cast<std::uint8_t>(albedo(scene, *p));
    }
  }
  return ground;
}

}  // namespace

bool is_on_white(const BoardInImage& scene, const Eigen::Vector2d& pixel) {
  const auto p = on_board(scene, pixel);
  return p && albedo(scene, *p) == 1;
}

bool straddles_albedo_edge(const BoardInImage& scene, const Eigen::Vector2d& pixel, StripeAxis axis,
                           double reach_px) {
  const Eigen::Vector2d across =
      axis == StripeAxis::kColumns ? Eigen::Vector2d(0.0, 1.0) : Eigen::Vector2d(1.0, 0.0);
  int first = -1;
  for (int step = -4; step <= 4; ++step) {
    const auto p = on_board(scene, pixel + 0.25 * step * reach_px * across);
    if (!p) return true;
    const int here = std::min(albedo(scene, *p), 1);
    if (first < 0) first = here;
    if (here != first) return true;
  }
  return false;
}

cv::Mat even_ground(const BoardInImage& scene, const std::vector<double>& across, StripeAxis axis,
                    const ProfileGround& profile) {
  const cv::Mat ground = ground_along(scene, across, axis, profile.far_px);
  cv::Mat lowest;
  cv::Mat highest;
  const cv::Mat around = cv::getStructuringElement(cv::MORPH_RECT, {5, 5});
  cv::erode(ground, lowest, around);
  cv::dilate(ground, highest, around);
  const cv::Mat even = lowest == highest;
  cv::Mat seen = cv::Mat::zeros(ground.size(), CV_8UC1);
  const bool columns = axis == StripeAxis::kColumns;
  const int length = columns ? ground.rows : ground.cols;
  for (std::size_t k = 0; k < across.size(); ++k) {
    if (!std::isfinite(across[k])) continue;
    const auto pixel = [&](int at) {
      return columns ? cv::Point(static_cast<int>(k), at) : cv::Point(at, static_cast<int>(k));
    };
    const int middle = static_cast<int>(std::lround(across[k]));
    const auto is_clear = [&](int at) {
      const bool inside = at >= 0 && at < length;
      if (!inside || ground.at<std::uint8_t>(pixel(at)) != ground.at<std::uint8_t>(pixel(middle)))
        return false;
      return std::abs(at - middle) > profile.clear_px || even.at<std::uint8_t>(pixel(at)) != 0;
    };
    if (middle < 0 || middle >= length || ground.at<std::uint8_t>(pixel(middle)) == kUnknown)
      continue;
    const int reach = static_cast<int>(std::ceil(std::max(profile.same_px, profile.clear_px)));
    bool clear = true;
    for (int at = middle - reach; at <= middle + reach; ++at) clear &= is_clear(at);
    const int half = static_cast<int>(profile.far_px);
    const int first = std::max(0, middle - half);
    const int last = clear ? std::min(length - 1, middle + half) : -1;
    for (int at = first; at <= last; ++at)
      if (even.at<std::uint8_t>(pixel(at)) != 0 &&
          ground.at<std::uint8_t>(pixel(at)) == ground.at<std::uint8_t>(pixel(middle)))
        seen.at<std::uint8_t>(pixel(at)) = 255;
  }
  return seen;
}

}  // namespace detail

cv::Mat board_mask(const Board& board, const CameraModel& camera,
                   const Eigen::Isometry3d& T_cam_board, double margin_squares) {
  const double out = board.print_border_m() + margin_squares * board.square_m;
  const Eigen::Vector2d low(-out, -out);
  const Eigen::Vector2d high = 2.0 * board.half_extent_m() + Eigen::Vector2d(out, out);
  const std::array<Eigen::Vector2d, 5> ring = {low, Eigen::Vector2d(high.x(), low.y()), high,
                                               Eigen::Vector2d(low.x(), high.y()), low};
  constexpr int kSteps = 24;  // A straight edge is curved in the image.
  std::vector<cv::Point> outline;
  for (std::size_t side = 0; side + 1 < ring.size(); ++side)
    for (int step = 0; step < kSteps; ++step) {
      const Eigen::Vector2d p = ring[side] + (ring[side + 1] - ring[side]) * step / kSteps;
      const Projection at = camera.project(T_cam_board * Eigen::Vector3d(p.x(), p.y(), 0.0));
      if (at.status != CameraStatus::kOk) continue;
      const Eigen::Vector2d clamped = at.pixel.cwiseMax(-1e4).cwiseMin(1e5);
      outline.emplace_back(static_cast<int>(std::lround(clamped.x())),
                           static_cast<int>(std::lround(clamped.y())));
    }
  cv::Mat mask = cv::Mat::zeros(camera.height(), camera.width(), CV_8UC1);
  if (outline.size() >= 3)
    cv::fillPoly(mask, std::vector<std::vector<cv::Point>>{outline}, cv::Scalar(255));
  return mask;
}

}  // namespace striper
