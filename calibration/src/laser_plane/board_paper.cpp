// SPDX-License-Identifier: Apache-2.0
#include "laser_plane/board_paper.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include <striper/core/robust.hpp>

namespace striper::detail {
namespace {

constexpr int kAlong = 48;              // Places along a side,
constexpr double kStepSquares = 0.05;   // and steps outward.
constexpr double kFirstSquares = 0.25;  // Clear of the print's own blur.
constexpr double kSpanSquares = kMarginSquares - kFirstSquares + 0.5 * kStepSquares;
constexpr int kSteps = static_cast<int>(kSpanSquares / kStepSquares);
constexpr std::size_t kFewest = 6;   // Places that say how bright the image is in a step.
constexpr double kSameWhite = 0.15;  // Of the difference of white and black.

// One side of the print: where it begins, along it, and out of it; metres.
struct Side {
  Eigen::Vector2d begin_m;
  Eigen::Vector2d along_m;
  Eigen::Vector2d outward;
};

std::array<Side, 4> sides_of(const Board& board) {
  const double border_m = board.print_border_m();
  const Eigen::Vector2d low = Eigen::Vector2d::Constant(-border_m);
  const Eigen::Vector2d high = 2.0 * board.half_extent_m() - low;
  const Eigen::Vector2d x(high.x() - low.x(), 0.0);
  const Eigen::Vector2d y(0.0, high.y() - low.y());
  return {Side{low, y, -Eigen::Vector2d::UnitX()}, Side{low, x, -Eigen::Vector2d::UnitY()},
          Side{low + x, y, Eigen::Vector2d::UnitX()}, Side{low + y, x, Eigen::Vector2d::UnitY()}};
}

class PaperFinder {
 public:
  PaperFinder(const cv::Mat& grey, const Board& board, const CameraModel& camera,
              const Eigen::Isometry3d& T_cam_board, const StripeCourse& stripe)
      : grey_(grey), board_(board), camera_(camera), T_cam_board_(T_cam_board), stripe_(stripe) {}

  // How far the paper goes beyond a side of the print, metres.
  double margin_m(const Side& side) const {
    // Half a square inside of the print's end black and white take turns.
    const double inside_m = -0.5 * board_.square_m;
    const auto white = level(side, inside_m, 0.85);
    const auto black = level(side, inside_m, 0.15);
    if (!white || !black) return 0.0;
    const double same = kSameWhite * (*white - *black);
    double clear_m = 0.0;
    for (int k = 0; k < kSteps; ++k) {
      const double out = kFirstSquares + k * kStepSquares;
      const auto here = level(side, out * board_.square_m, 0.5);
      if (here && std::abs(*here - *white) > same) return clear_m;
      clear_m = out * board_.square_m;
    }
    return kMarginSquares * board_.square_m;
  }

 private:
  // A quantile of the brightness along a side, `out_m` outside of the print; empty where the stripe
  // covers it or the image ends.
  std::optional<double> level(const Side& side, double out_m, double quantile) const {
    std::vector<std::uint8_t> seen;
    for (int i = 0; i < kAlong; ++i) {
      const Eigen::Vector2d p =
          side.begin_m + (i + 0.5) / kAlong * side.along_m + out_m * side.outward;
      const Projection at = camera_.project(T_cam_board_ * Eigen::Vector3d(p.x(), p.y(), 0.0));
      if (at.status != CameraStatus::kOk) continue;
      const auto u = std::lround(at.pixel.x());
      const auto v = std::lround(at.pixel.y());
      if (u < 0 || v < 0 || u >= grey_.cols || v >= grey_.rows || is_lit(u, v)) continue;
      seen.push_back(grey_.at<std::uint8_t>(static_cast<int>(v), static_cast<int>(u)));
    }
    if (seen.size() < kFewest) return std::nullopt;
    const double last = static_cast<double>(seen.size() - 1);
    return nth_smallest(seen, static_cast<std::size_t>(quantile * last));
  }

  bool is_lit(long u, long v) const {
    const bool columns = stripe_.axis == StripeAxis::kColumns;
    const auto line = static_cast<std::size_t>(columns ? u : v);
    if (line >= stripe_.across.size()) return false;
    const double across = stripe_.across[line];
    return std::abs(static_cast<double>(columns ? v : u) - across) <= stripe_.reach_px;
  }

  const cv::Mat& grey_;
  const Board& board_;
  const CameraModel& camera_;
  const Eigen::Isometry3d& T_cam_board_;
  const StripeCourse& stripe_;
};

}  // namespace

Eigen::AlignedBox2d find_paper(const cv::Mat& grey, const Board& board, const CameraModel& camera,
                               const Eigen::Isometry3d& T_cam_board, const StripeCourse& stripe) {
  const PaperFinder finder(grey, board, camera, T_cam_board, stripe);
  const Eigen::Vector2d border = Eigen::Vector2d::Constant(board.print_border_m());
  Eigen::AlignedBox2d paper(-border, 2.0 * board.half_extent_m() + border);
  for (const Side& side : sides_of(board)) {
    const Eigen::Vector2d out = finder.margin_m(side) * side.outward;
    paper.min() += out.cwiseMin(0.0);
    paper.max() += out.cwiseMax(0.0);
  }
  return paper;
}

}  // namespace striper::detail
