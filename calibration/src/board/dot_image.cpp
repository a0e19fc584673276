// SPDX-License-Identifier: Apache-2.0
#include "board/dot_image.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>

namespace striper::detail {
namespace {

// In spacings of the grid: within kCore all is black, from kInner to kOuter all is white.
constexpr double kCore = 0.08;
constexpr double kInner = 0.42;
constexpr double kOuter = 0.50;

// The pixels of a cell, in spacings from its middle.
template <typename Visit>
void visit_cell(const cv::Mat& grey, const Eigen::Vector2d& centre, const Eigen::Matrix2d& axes,
                Visit&& visit) {
  const Eigen::Matrix2d to_grid = axes.inverse();
  const Eigen::Vector2d reach = kOuter * axes.rowwise().norm();
  const int left = std::max(0, static_cast<int>(std::ceil(centre.x() - reach.x())));
  const int right = std::min(grey.cols - 1, static_cast<int>(std::floor(centre.x() + reach.x())));
  const int top = std::max(0, static_cast<int>(std::ceil(centre.y() - reach.y())));
  const int bottom = std::min(grey.rows - 1, static_cast<int>(std::floor(centre.y() + reach.y())));
  for (int row = top; row <= bottom; ++row)
    for (int column = left; column <= right; ++column) {
      const Eigen::Vector2d d(column - centre.x(), row - centre.y());
      const double radius = (to_grid * d).norm();
      if (radius <= kOuter)
        visit(d, radius, static_cast<double>(grey.at<std::uint8_t>(row, column)));
    }
}

// White as it is shaded across a cell, and black in the middle of it.
struct Levels {
  Eigen::Vector3d white;  // At the middle, and per pixel along u and v.
  double black = 0.0;

  double white_at(const Eigen::Vector2d& d) const { return white[0] + white.tail<2>().dot(d); }
};

std::optional<Levels> levels_of(const cv::Mat& grey, const Eigen::Vector2d& centre,
                                const Eigen::Matrix2d& axes) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double black = 0.0;
  int in_core = 0;
  int in_ring = 0;
  visit_cell(grey, centre, axes, [&](const Eigen::Vector2d& d, double radius, double value) {
    if (radius <= kCore) black += value, ++in_core;
    if (radius < kInner) return;
    const Eigen::Vector3d terms(1.0, d.x(), d.y());
    A += terms * terms.transpose();
    b += value * terms;
    ++in_ring;
  });
  if (in_core == 0) {
    const cv::Point middle(static_cast<int>(std::lround(centre.x())),
                           static_cast<int>(std::lround(centre.y())));
    if (!cv::Rect(0, 0, grey.cols, grey.rows).contains(middle)) return std::nullopt;
    black = grey.at<std::uint8_t>(middle);
    in_core = 1;
  }
  if (in_ring < 8) return std::nullopt;
  const Levels levels{A.ldlt().solve(b), black / in_core};
  constexpr double kLeastContrastDn = 10.0;
  if (!levels.white.allFinite() || levels.white[0] - levels.black < kLeastContrastDn)
    return std::nullopt;
  return levels;
}

}  // namespace

std::optional<DotImage> measure_dot(const cv::Mat& grey, const Eigen::Vector2d& start_px,
                                    const Eigen::Vector2d& along, const Eigen::Vector2d& down) {
  Eigen::Matrix2d axes;
  axes << along, down;
  Eigen::Vector2d centre = start_px;
  double radius_squares = 0.0;
  for (int pass = 0; pass < 3; ++pass) {  // The cell follows the centre.
    const auto levels = levels_of(grey, centre, axes);
    if (!levels) return std::nullopt;
    Eigen::Vector2d moment = Eigen::Vector2d::Zero();
    double area = 0.0;
    visit_cell(grey, centre, axes, [&](const Eigen::Vector2d& d, double radius, double value) {
      if (radius >= kInner) return;
      const double white = levels->white_at(d);
      const double darkness = (white - value) / std::max(white - levels->black, 1.0);
      moment += darkness * d;
      area += darkness;
    });
    radius_squares = std::sqrt(area / (std::numbers::pi * std::abs(axes.determinant())));
    if (!(radius_squares > kCore && radius_squares < kInner)) return std::nullopt;
    centre += moment / area;
    if (!((centre - start_px).norm() < 0.25 * axes.col(0).norm() + 1.0)) return std::nullopt;
  }
  return DotImage{centre, radius_squares};
}

}  // namespace striper::detail
