// SPDX-License-Identifier: Apache-2.0
#include <iterator>

#include <fmt/format.h>

#include <striper/board/board.hpp>

namespace striper {
namespace {

constexpr double kCaptionMm = 14.0;
constexpr double kRulerMm = 100.0;

// Squares of a checkerboard: one more each way than there are inner corners.
void draw_squares(const Board& board, double left_mm, double top_mm, std::string& svg) {
  const double side_mm = 1000.0 * board.square_m;
  for (int row = 0; row <= board.rows; ++row)
    for (int column = row % 2; column <= board.columns; column += 2)
      fmt::format_to(std::back_inserter(svg),
                     "<rect x=\"{:.4f}\" y=\"{:.4f}\" width=\"{:.4f}\" height=\"{:.4f}\"/>\n",
                     left_mm + column * side_mm, top_mm + row * side_mm, side_mm, side_mm);
}

// Circles of half the spacing in diameter, each in the middle of its cell.
void draw_circles(const Board& board, double left_mm, double top_mm, std::string& svg) {
  const double spacing_mm = 1000.0 * board.square_m;
  for (int row = 0; row < board.rows; ++row)
    for (int column = 0; column < board.columns; ++column)
      fmt::format_to(std::back_inserter(svg),
                     "<circle cx=\"{:.4f}\" cy=\"{:.4f}\" r=\"{:.4f}\"/>\n",
                     left_mm + (column + 0.5) * spacing_mm, top_mm + (row + 0.5) * spacing_mm,
                     0.25 * spacing_mm);
}

void draw_caption(const Board& board, double left_mm, double y_mm, std::string& svg) {
  fmt::format_to(std::back_inserter(svg),
                 "<text x=\"{:.2f}\" y=\"{:.2f}\" font-family=\"sans-serif\" font-size=\"4\">"
                 "striper board {}, {} {:g} mm. Print at 100 %, check the ruler, glue to "
                 "something flat.</text>\n",
                 left_mm, y_mm, to_string(board),
                 board.pattern == Board::Pattern::kCheckerboard ? "square" : "spacing",
                 1000.0 * board.square_m);
  fmt::format_to(std::back_inserter(svg),
                 "<path d=\"M{0:.2f} {1:.2f}v3h{2:.2f}v-3\" fill=\"none\" stroke=\"black\" "
                 "stroke-width=\"0.3\"/>\n<text x=\"{3:.2f}\" y=\"{4:.2f}\" "
                 "font-family=\"sans-serif\" font-size=\"4\">{2:g} mm</text>\n",
                 left_mm, y_mm + 3.0, kRulerMm, left_mm + kRulerMm + 2.0, y_mm + 6.0);
}

}  // namespace

Eigen::Vector2d board_sheet_m(const Board& board) {
  const int more = board.pattern == Board::Pattern::kCheckerboard ? 1 : 0;
  // One square of white all round: finders need it, and the stripe is seen best on it.
  return {board.square_m * (board.columns + more + 2),
          board.square_m * (board.rows + more + 2) + 1e-3 * kCaptionMm};
}

std::string board_svg(const Board& board) {
  board.validate();
  const bool checkerboard = board.pattern == Board::Pattern::kCheckerboard;
  const double square_mm = 1000.0 * board.square_m;
  const double print_height_mm = square_mm * (board.rows + (checkerboard ? 1 : 0));
  const Eigen::Vector2d sheet_mm = 1000.0 * board_sheet_m(board);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.4f}mm\" height=\"{1:.4f}mm\" "
      "viewBox=\"0 0 {0:.4f} {1:.4f}\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      sheet_mm.x(), sheet_mm.y());
  if (checkerboard)
    draw_squares(board, square_mm, square_mm, svg);
  else
    draw_circles(board, square_mm, square_mm, svg);
  draw_caption(board, square_mm, print_height_mm + 2.0 * square_mm, svg);
  svg += "</svg>\n";
  return svg;
}

}  // namespace striper
