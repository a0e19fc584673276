// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>

#include <fmt/format.h>

#include <striper/core/csv_table.hpp>
#include <striper/core/error.hpp>

namespace striper::detail {
namespace {

// What a message shows of a cell: the beginning, and nothing that a terminal would obey.
std::string shown(std::string_view cell) {
  constexpr std::size_t kMost = 60;
  std::string text(cell.substr(0, kMost));
  for (char& c : text) {
    if (std::iscntrl(static_cast<unsigned char>(c)) != 0) c = '?';
  }
  return cell.size() > kMost ? text + "..." : text;
}

}  // namespace

std::vector<int> read_csv_header(CsvInput& input, std::span<const CsvName> names,
                                 std::string_view table) {
  if (!input.next()) {
    throw Error(ErrorKind::kBadFile,
                fmt::format("'{}' is empty: no header line - expected {}", input.name(), table));
  }
  if (input.cells().empty()) input.refuse("a quote is never closed");
  std::vector<int> order;
  for (const std::string_view cell : input.cells()) {
    const auto found = std::find_if(names.begin(), names.end(),
                                    [&](const CsvName& column) { return column.name == cell; });
    const int index = found == names.end() ? -1 : static_cast<int>(found - names.begin());
    if (index >= 0 && std::find(order.begin(), order.end(), index) != order.end())
      input.refuse(fmt::format("the header has the column '{}' twice", cell));
    order.push_back(index);
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!names[i].is_required ||
        std::find(order.begin(), order.end(), static_cast<int>(i)) != order.end()) {
      continue;
    }
    throw Error(ErrorKind::kBadFile, fmt::format("'{}': the header has no column '{}': it is no {}",
                                                 input.name(), names[i].name, table));
  }
  return order;
}

void refuse_csv_cell(const CsvInput& input, std::string_view column, std::string_view cell,
                     const std::string& expected) {
  input.refuse(
      fmt::format("column '{}' cannot be '{}' - expected {}", column, shown(cell), expected));
}

bool has_all_cells(const CsvInput& input, std::size_t columns) {
  const std::size_t cells = input.cells().size();
  if (cells == columns) return true;
  if (!input.is_ended() && cells < columns) return false;
  input.refuse(fmt::format("{} fields, but the header has {}", cells, columns));
}

}  // namespace striper::detail
