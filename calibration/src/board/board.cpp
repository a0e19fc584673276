// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include <striper/board/board.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

constexpr std::string_view kCirclesPrefix = "circles:";
constexpr double kSmallestSquareM = 1e-4;
constexpr double kLargestSquareM = 10.0;  // Millimetres given for metres are mostly above it.

std::optional<int> whole_number(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

std::vector<Eigen::Vector2d> Board::points_m() const {
  std::vector<Eigen::Vector2d> points;
  points.reserve(static_cast<std::size_t>(point_count()));
  for (int i = 0; i < point_count(); ++i) points.push_back(point_m(i));
  return points;
}

Eigen::Vector2d Board::half_extent_m() const noexcept {
  return 0.5 * square_m * Eigen::Vector2d(columns - 1, rows - 1);
}

Eigen::Vector2d Board::centre_m() const noexcept { return half_extent_m(); }

void Board::validate() const {
  const auto bad_count = [](int n) { return n < 3 || n > 100; };
  if (bad_count(columns) || bad_count(rows))
    throw Error(ErrorKind::kBadValue,
                fmt::format("board size is {}x{}; expected 3 to 100 points each way, counted as "
                            "inner corners (columns x rows)",
                            columns, rows));
  if (!(square_m >= kSmallestSquareM && square_m <= kLargestSquareM))
    throw Error(ErrorKind::kBadValue,
                fmt::format("board square is {} m; expected {} to {} metres (40 mm are 0.040)",
                            square_m, kSmallestSquareM, kLargestSquareM));
}

Board parse_board(std::string_view text, double square_m) {
  std::string_view size = text;
  Board board;
  board.square_m = square_m;
  if (size.starts_with(kCirclesPrefix)) {
    board.pattern = Board::Pattern::kCircles;
    size.remove_prefix(kCirclesPrefix.size());
  }
  const std::size_t cross = size.find('x');
  const auto columns = whole_number(size.substr(0, cross));
  const auto rows =
      cross == std::string_view::npos ? std::nullopt : whole_number(size.substr(cross + 1));
  if (!columns || !rows)
    throw Error(ErrorKind::kUsage,
                fmt::format("board '{}' is not a size; expected inner corners as columns x rows, "
                            "for example 8x6, or circles:7x7",
                            text));
  board.columns = *columns;
  board.rows = *rows;
  board.validate();
  return board;
}

std::string to_string(const Board& board) {
  return fmt::format("{}{}x{}", board.pattern == Board::Pattern::kCircles ? kCirclesPrefix : "",
                     board.columns, board.rows);
}

}  // namespace striper
