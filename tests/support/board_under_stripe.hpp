// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include <opencv2/core/mat.hpp>

#include "support/random.hpp"

namespace striper::testing {

/// A checkerboard that fills the image, a little turned, and a straight stripe across its columns:
/// drawn pixel by pixel, 8 bit, without a camera's lens or a laser's plane (see board_picture.hpp).
struct BoardUnderStripe {
  int lines = 0, length_px = 0;
  double square_px = 0.0;
  double turn = 0.0;       ///< Pixels a pixel.
  double origin_px = 0.0;  ///< Of the rows of squares.
  double first_px = 0.0;   ///< The stripe in the first scan line,
  double slope = 0.0;      ///< and on from there.
  double width_px = 0.0;   ///< Gaussian sigma.
  double white_dn = 0.0, stripe_dn = 0.0;
  double black = 0.0;    ///< Of white, of both.
  double blur_px = 1.0;  ///< A pixel sees a square of that side,
  int parts = 4;         ///< drawn of so many parts each way.
  double noise_dn = 0.0;
};

inline double stripe_at(const BoardUnderStripe& board, double line) {
  return board.first_px + board.slope * line;
}

inline double board_reflectance(const BoardUnderStripe& board, double along, double across) {
  const double x = along + board.turn * across;
  const double y = across - board.turn * along + board.origin_px;
  const auto column = static_cast<int>(std::floor(x / board.square_px));
  const auto row = static_cast<int>(std::floor(y / board.square_px));
  return (column + row) % 2 == 0 ? 1.0 : board.black;
}

/// What a pixel of it sees, without noise.
inline double expected_dn(const BoardUnderStripe& board, int line, int pixel) {
  constexpr double kBlackLevel_dn = 5.0;
  double sum = 0.0;
  for (int right = 0; right < board.parts; ++right) {
    for (int down = 0; down < board.parts; ++down) {
      const double x = line + board.blur_px * ((right + 0.5) / board.parts - 0.5);
      const double y = pixel + board.blur_px * ((down + 0.5) / board.parts - 0.5);
      const double off = (y - stripe_at(board, line)) / board.width_px;
      sum += board_reflectance(board, x, y) *
             (board.white_dn + board.stripe_dn * std::exp(-0.5 * off * off));
    }
  }
  return kBlackLevel_dn + sum / (board.parts * board.parts);
}

inline cv::Mat draw(const BoardUnderStripe& board) {
  cv::Mat image(board.length_px, board.lines, CV_8U);
  for (int line = 0; line < board.lines; ++line) {
    for (int pixel = 0; pixel < board.length_px; ++pixel) {
      image.at<std::uint8_t>(pixel, line) =
          cv::saturate_cast<std::uint8_t>(normal(expected_dn(board, line, pixel), board.noise_dn));
    }
  }
  return image;
}

}  // namespace striper::testing
