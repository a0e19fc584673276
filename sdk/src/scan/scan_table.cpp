// SPDX-License-Identifier: Apache-2.0
#include "scan/scan_table.hpp"

#include <array>
#include <cstddef>
#include <iterator>
#include <string>
#include <utility>
#include <variant>

#include "scan/scan_columns.hpp"

namespace striper::detail {
namespace {

template <typename Value>
struct StatusCell {
  Value& value;
};
template <typename Value>
StatusCell(Value&) -> StatusCell<Value>;

template <typename Value>
void write_cell(std::string& out, const StatusCell<Value>& cell) {
  out += to_string(cell.value);
}
bool read_cell(std::string_view text, StatusCell<ReturnStatus> cell) {
  const auto status = return_status_from_string(text);
  cell.value = status.value_or(ReturnStatus::kNoStripe);
  return status.has_value();
}
template <typename Value>
std::string expected_cell(const StatusCell<Value>&) {
  std::array<std::string_view, kReturnStatusCount> words;
  for (int i = 0; i < kReturnStatusCount; ++i) {
    words[static_cast<std::size_t>(i)] = to_string(static_cast<ReturnStatus>(i));
  }
  return expected_one_of(words.data(), words.size());
}

// A laser is one of 64, as in a pattern.
constexpr int kLastLaser = 63;

// A number of the return, by its place in `kScanColumns`.
template <std::size_t kIndex>
constexpr CsvColumn<ScanRow> number_column() {
  constexpr const ScanColumn& kColumn = kScanColumns[kIndex];
  const auto cell = [](auto& row) -> auto& {
    constexpr auto kMember =
        std::get<kScanColumns[kIndex].member.index()>(kScanColumns[kIndex].member);
    return row.point.*kMember;
  };
  const CsvNeed need = kColumn.is_required ? CsvNeed::kRequired : CsvNeed::kOptional;
  return csv_column<ScanRow>(kColumn.name, cell, need);
}

template <std::size_t... kIndices>
constexpr auto make_columns(std::index_sequence<kIndices...> /*numbers*/) {
  return std::array{
      csv_column<ScanRow>(
          "frame", [](auto& r) -> auto& { return r.frame; }, CsvNeed::kRequired),
      csv_column<ScanRow>(
          "time_s",
          [](auto& r) {
            return CsvBetween{r.time_s, -FrameTime::kMostSeconds, FrameTime::kMostSeconds};
          },
          CsvNeed::kRequired),
      csv_column<ScanRow>("laser",
                          [](auto& r) {
                            return CsvBetween{r.laser, 0, kLastLaser};
                          }),
      number_column<kIndices>()...,
      csv_column<ScanRow>("status", [](auto& r) { return StatusCell{r.point.status}; }),
  };
}

constexpr auto kColumns = make_columns(std::make_index_sequence<std::size(kScanColumns)>());

}  // namespace

std::span<const CsvColumn<ScanRow>> scan_columns() { return kColumns; }

}  // namespace striper::detail
