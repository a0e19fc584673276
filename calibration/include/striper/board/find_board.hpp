// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include <striper/board/board.hpp>

namespace striper {

/// The board in one image.
struct BoardView {
  bool found = false;
  std::string reason;  ///< Why it was not found, for people; empty when found.

  /// One per board point, row by row, in pixels ((0, 0) = centre of the top-left pixel).
  ///
  /// The order is never mirrored (z of the board frame points away from the camera) and begins at
  /// the same physical corner in every image wherever the board tells its ends apart (one of
  /// columns and rows is odd, the other even); otherwise at the end nearer to the image's top left.
  std::vector<Eigen::Vector2d> corners_px;

  /// Circles: the points are centres of the dots' areas, and this is their radius, in spacings.
  double dot_ratio = 0.0;

  double square_px = 0.0;  ///< Median distance of neighbouring points in the image.
  double blur_px = 0.0;    ///< Gaussian sigma of the edges: above ~2 px is blur. 0 for circles.

  /// Per corner: 0 where the image does not look like a corner there (the stripe or a glare runs
  /// across it), so that its place is not to be relied on.
  std::vector<char> reliable;
  bool by_classic_finder = false;
};

/// How hard to look for a checkerboard; circles are looked for in one way only.
enum class BoardSearch {
  kThorough,  ///< All that there is, the enlarged image too; longest where there is no board.
  /// As OpenCV's calibration sample does: its classic finder, then cv::cornerSubPix in a window of
  /// 23x23 pixels, which near the edge of the sheet takes the edge for the corner's. To compare.
  kLikeOpenCv,
  kQuick,  ///< A small part of that. For live frames: another one follows.
};

/// Finds the board in an image and refines its points to sub-pixel.
///
/// First the Radon finder (Duda & Frese 2018, cv::findChessboardCornersSB), then the classic one
/// (the only one of a quick search), then the first on an enlarged image; then each corner is
/// refined by a fit of two blurred edges that cross, inside its own, possibly foreshortened,
/// squares: a window that reaches into the neighbouring squares is the best-known trap of oblique
/// views. On rendered boards the corners come out within 0.02 px rms. Of circles the centre of the
/// dark area is found: seen obliquely, it is not where the circle's centre is, and the adjustment
/// compares it with the centre of the area that it predicts.
/// @param image CV_8U or CV_16U, one or three channels.
/// @throws Error{kBadValue} where the image is empty or of another type. An image without a board
/// is no error: see `reason`. Cost: see BoardSearch. Thread-safe.
BoardView find_board(const cv::Mat& image, const Board& board,
                     BoardSearch search = BoardSearch::kThorough);

/// Returns the image as 8-bit grey, 16 bit scaled by its own brightest pixel.
cv::Mat to_grey8(const cv::Mat& image);

/// Says which other size a board has, where the given one is not found but another is: for the
/// mistake of counting squares in place of inner corners. Empty where nothing is found. Slow.
std::string guess_board_size(const cv::Mat& image, const Board& board);

}  // namespace striper
