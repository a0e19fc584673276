// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace striper::program {

/// How a character stands out. Without colours the words and the signs say the same.
enum class Look { kPlain, kBar, kChosen, kPaint, kThreshold, kInformation, kWarning, kError };

/// A screen of characters, drawn before it is shown. What lies outside of it is left out.
class TextCanvas {
 public:
  struct Cell {
    char character = ' ';
    Look look = Look::kPlain;
  };

  TextCanvas(int rows, int columns);

  int rows() const noexcept { return rows_; }
  int columns() const noexcept { return columns_; }
  const Cell& at(int row, int column) const;

  void put(int row, int column, std::string_view text, Look look = Look::kPlain);
  /// A frame of + - | with its title in the upper side; its inside is cleared.
  void box(int row, int column, int rows, int columns, std::string_view title = {});

  /// Line by line, without blanks at the ends.
  std::vector<std::string> lines() const;

 private:
  int rows_;
  int columns_;
  std::vector<Cell> cells_;
};

}  // namespace striper::program
