// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <striper/core/append_file.hpp>
#include <striper/core/csv_cell.hpp>
#include <striper/core/csv_file.hpp>

namespace striper {

enum class CsvNeed {
  kRequired,  ///< A table without this column is refused.
  kOptional,  ///< Without it a row keeps what it had.
};

/// One column of a table whose rows are `Row`: its name, its type, how it is written and read. Made
/// by `csv_column`; a table is an array of them, and that is all there is to say about a table.
template <typename Row>
struct CsvColumn {
  std::string_view name;
  CsvNeed need = CsvNeed::kOptional;
  bool is_text = false;  ///< Else half of its text may read as another value.
  void (*write)(std::string& out, const Row& row) = nullptr;
  bool (*read)(std::string_view cell, Row& row) = nullptr;
  std::string (*expected)() = nullptr;
};

namespace detail {

template <typename Value>
inline constexpr bool kIsCsvText = std::is_same_v<Value, std::string>;
template <typename Value, std::size_t kCount>
inline constexpr bool kIsCsvText<CsvWords<Value, kCount>> = true;

}  // namespace detail

/// Describes a column once, for reading and writing.
/// @param cell a lambda without captures, `[](auto& row) -> auto& { return row.member; }`, or what
///        a cell is made of: `[](auto& row) { return CsvBetween{row.bits, 8, 16}; }`.
template <typename Row, typename Cell>
constexpr CsvColumn<Row> csv_column(std::string_view name, Cell /*cell*/,
                                    CsvNeed need = CsvNeed::kOptional) {
  using Value = std::remove_cvref_t<decltype(Cell{}(std::declval<Row&>()))>;
  return {name,
          need,
          detail::kIsCsvText<Value>,
          [](std::string& out, const Row& row) { write_cell(out, Cell{}(row)); },
          [](std::string_view text, Row& row) { return read_cell(text, Cell{}(row)); },
          [] {
            Row row{};
            return expected_cell(Cell{}(row));
          }};
}

namespace detail {

/// A column's name, and whether a table must have it.
struct CsvName {
  std::string_view name;
  bool is_required;
};

/// Reads the header line. @return for each column of the file its index in `names`, or -1.
/// @throws Error{kBadFile} where there is none, a column is there twice or a required one is not.
std::vector<int> read_csv_header(CsvInput& input, std::span<const CsvName> names,
                                 std::string_view table);

[[noreturn]] void refuse_csv_cell(const CsvInput& input, std::string_view column,
                                  std::string_view cell, const std::string& expected);

/// @return false where the last line was cut off. @throws Error{kBadFile} on too few or many cells.
bool has_all_cells(const CsvInput& input, std::size_t columns);

}  // namespace detail

/// Reads a table row by row. Columns are found by name, in any order; unknown ones are ignored.
///
/// A last line that was cut off (no line end, and cells missing, or a number at its end that may be
/// half of itself) is left out, and `cut_line` says so. Nothing is allocated per row but what the
/// row itself keeps. Not thread-safe.
template <typename Row>
class CsvReader {
 public:
  /// Reads the header. @param table what it should be, for messages: "a frame table".
  /// @throws Error as `CsvInput` does, Error{kBadFile} naming the column that is missing.
  CsvReader(CsvInput input, std::span<const CsvColumn<Row>> columns, std::string_view table)
      : input_(std::move(input)), columns_(columns) {
    std::vector<detail::CsvName> names;
    for (const auto& c : columns) names.push_back({c.name, c.need == CsvNeed::kRequired});
    order_ = detail::read_csv_header(input_, names, table);
  }

  /// Puts the next row into `row`; columns that the table does not have leave it as it is.
  /// @return false at the end.
  /// @throws Error{kBadFile} naming file, line, column, value and what was expected; Error{kIo}.
  bool next(Row& row) {
    if (!input_.next()) return false;
    if (!detail::has_all_cells(input_, order_.size())) return leave_out();
    if (!input_.is_ended() && ends_in_number()) return leave_out();
    for (std::size_t i = 0; i < order_.size(); ++i) {
      if (order_[i] < 0) continue;
      const CsvColumn<Row>& column = columns_[static_cast<std::size_t>(order_[i])];
      const std::string_view cell = input_.cells()[i];
      if (column.read(cell, row)) continue;
      if (!input_.is_ended()) return leave_out();
      detail::refuse_csv_cell(input_, column.name, cell, column.expected());
    }
    return true;
  }

  /// Whether the table has a column.
  bool has(std::string_view name) const noexcept {
    for (const int index : order_) {
      if (index >= 0 && columns_[static_cast<std::size_t>(index)].name == name) return true;
    }
    return false;
  }

  std::size_t line() const noexcept { return input_.line(); }  ///< Of the row, in the file.
  /// The line that was cut off; 0 where none was.
  std::size_t cut_line() const noexcept { return cut_line_; }
  const CsvInput& input() const noexcept { return input_; }

 private:
  bool leave_out() noexcept {
    cut_line_ = input_.line();
    return false;
  }
  bool ends_in_number() const noexcept {
    const int last = order_.back();
    return last >= 0 && !columns_[static_cast<std::size_t>(last)].is_text;
  }

  CsvInput input_;
  std::span<const CsvColumn<Row>> columns_;
  std::vector<int> order_;
  std::size_t cut_line_ = 0;
};

/// Writes a table, header first. As `AppendFile` in all that is not said here.
template <typename Row>
class CsvWriter {
 public:
  CsvWriter(std::string path, std::span<const CsvColumn<Row>> columns,
            AppendFile::Mode mode = AppendFile::Mode::kReplace)
      : output_(std::move(path), mode), columns_(columns) {
    append_header(output_.lines(), columns);
    output_.flush();
  }

  /// Adds a row; it is on the disk after `flush`.
  void add(const Row& row) { append(output_.lines(), columns_, row); }
  void flush() { output_.flush(); }
  void close() { output_.close(); }

  static void append_header(std::string& out, std::span<const CsvColumn<Row>> columns) {
    for (const CsvColumn<Row>& column : columns) (out += column.name) += ',';
    out.back() = '\n';
  }
  static void append(std::string& out, std::span<const CsvColumn<Row>> columns, const Row& row) {
    for (const CsvColumn<Row>& column : columns) {
      column.write(out, row);
      out += ',';
    }
    out.back() = '\n';
  }

 private:
  AppendFile output_;
  std::span<const CsvColumn<Row>> columns_;
};

}  // namespace striper
