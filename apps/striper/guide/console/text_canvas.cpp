// SPDX-License-Identifier: Apache-2.0
#include "guide/console/text_canvas.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace striper::program {

TextCanvas::TextCanvas(int rows, int columns)
    : rows_(std::max(rows, 1)),
      columns_(std::max(columns, 1)),
      cells_(static_cast<std::size_t>(rows_) * static_cast<std::size_t>(columns_)) {}

const TextCanvas::Cell& TextCanvas::at(int row, int column) const {
  return cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                static_cast<std::size_t>(column)];
}

void TextCanvas::put(int row, int column, std::string_view text, Look look) {
  if (row < 0 || row >= rows_) return;
  for (const char character : text) {
    if (column >= 0 && column < columns_) {
      const bool is_shown = character >= ' ' && character < 0x7f;
      cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
             static_cast<std::size_t>(column)] = {is_shown ? character : '?', look};
    }
    ++column;
  }
}

void TextCanvas::box(int row, int column, int rows, int columns, std::string_view title) {
  if (rows < 2 || columns < 2) return;
  const std::string side = fmt::format("+{:-<{}}+", "", columns - 2);
  const std::string inside = fmt::format("|{:{}}|", "", columns - 2);
  for (int i = 0; i < rows; ++i) put(row + i, column, i == 0 || i == rows - 1 ? side : inside);
  if (title.empty()) return;
  const int length = static_cast<int>(title.size()) + 2;
  put(row, column + std::max((columns - length) / 2, 1), fmt::format(" {} ", title));
}

std::vector<std::string> TextCanvas::lines() const {
  std::vector<std::string> lines;
  for (int row = 0; row < rows_; ++row) {
    std::string line;
    for (int column = 0; column < columns_; ++column) line += at(row, column).character;
    line.erase(line.find_last_not_of(' ') + 1);
    lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace striper::program
