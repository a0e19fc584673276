// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace striper {

/// The flat target of a calibration: a checkerboard, or a regular grid of dark circles.
///
/// Its frame: origin at the first point, x along the columns, y along the rows, z = x cross y (away
/// from the camera that looks at the printed side), metres.
struct Board {
  enum class Pattern { kCheckerboard, kCircles };

  Pattern pattern = Pattern::kCheckerboard;
  int columns = 0;        ///< Inner corners (or circles) along x.
  int rows = 0;           ///< Inner corners (or circles) along y.
  double square_m = 0.0;  ///< Side of a square, or distance of neighbouring circle centres.
  /// Circles: radius over that distance. `board_svg` draws 0.25; a calibration measures it.
  double dot_ratio = 0.25;

  int point_count() const noexcept { return columns * rows; }

  /// Point `index` = row * columns + column in the board frame, z = 0.
  Eigen::Vector2d point_m(int index) const noexcept {
    const int row = index / columns;
    return {square_m * (index - row * columns), square_m * row};
  }
  std::vector<Eigen::Vector2d> points_m() const;

  /// The middle of the pattern and half of its extent, metres: what a bend is measured over.
  Eigen::Vector2d centre_m() const noexcept;
  Eigen::Vector2d half_extent_m() const noexcept;

  /// Of the circles; 0 for corners.
  double dot_radius_m() const noexcept {
    return pattern == Pattern::kCircles ? dot_ratio * square_m : 0.0;
  }

  /// How far the print goes beyond the outer points: one square for a checkerboard, half a spacing
  /// for circles. The white margin begins there.
  double print_border_m() const noexcept {
    return pattern == Pattern::kCheckerboard ? square_m : 0.5 * square_m;
  }

  /// @throws Error{kBadValue} for fewer than 3 x 3 points, more than 100 x 100, or a square that is
  /// not 0.1 mm to 10 m large.
  void validate() const;
};

/// Reads `8x6` (inner corners, columns x rows) or `circles:7x7`.
/// @throws Error{kUsage} quoting the text and the two forms.
Board parse_board(std::string_view text, double square_m);

/// The inverse of `parse_board`, without the square.
std::string to_string(const Board& board);

/// How large the drawing of `board_svg` is, metres: the print, a square of white all round, and a
/// caption below.
Eigen::Vector2d board_sheet_m(const Board& board);

/// Draws a target as SVG at true scale, with a white margin and its size and square written on it
/// together with a 100 mm ruler to check the print with.
std::string board_svg(const Board& board);

}  // namespace striper
