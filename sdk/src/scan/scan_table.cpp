// SPDX-License-Identifier: Apache-2.0
#include "scan/scan_table.hpp"

#include <array>
#include <string>

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

// Times are 64 bits of nanoseconds, with as much to spare for an offset; a laser is one of 64, as
// in a cadence.
constexpr double kMostSeconds = 4e9;
constexpr int kLastLaser = 63;

template <typename Cell>
constexpr CsvColumn<ScanRow> column(std::string_view name, Cell cell,
                                    CsvNeed need = CsvNeed::kOptional) {
  return csv_column<ScanRow>(name, cell, need);
}

// Those that a scan of whatever origin must have are the required ones.
constexpr std::array kColumns{
    column(
        "frame", [](auto& r) -> auto& { return r.frame; }, CsvNeed::kRequired),
    column(
        "time_s",
        [](auto& r) {
          return CsvBetween{r.time_s, -kMostSeconds, kMostSeconds};
        },
        CsvNeed::kRequired),
    column("laser",
           [](auto& r) {
             return CsvBetween{r.laser, 0, kLastLaser};
           }),
    column(
        "u_px", [](auto& r) -> auto& { return r.point.u_px; }),
    column(
        "v_px", [](auto& r) -> auto& { return r.point.v_px; }),
    column(
        "bearing_rad", [](auto& r) -> auto& { return r.point.bearing_rad; }, CsvNeed::kRequired),
    column(
        "range_m", [](auto& r) -> auto& { return r.point.range_m; }, CsvNeed::kRequired),
    column(
        "range_near_m", [](auto& r) -> auto& { return r.point.range_near_m; }),
    column(
        "range_far_m", [](auto& r) -> auto& { return r.point.range_far_m; }),
    column(
        "sigma_m", [](auto& r) -> auto& { return r.point.sigma_m; }),
    column(
        "sigma_cal_m", [](auto& r) -> auto& { return r.point.sigma_cal_m; }),
    column(
        "x_m", [](auto& r) -> auto& { return r.point.x_m; }),
    column(
        "y_m", [](auto& r) -> auto& { return r.point.y_m; }),
    column(
        "intensity", [](auto& r) -> auto& { return r.point.intensity_dn; }),
    column(
        "width_px", [](auto& r) -> auto& { return r.point.width_px; }),
    column(
        "row_sigma_px", [](auto& r) -> auto& { return r.point.row_sigma_px; }),
    column(
        "confidence", [](auto& r) -> auto& { return r.point.confidence; }),
    column("status", [](auto& r) { return StatusCell{r.point.status}; }),
};

}  // namespace

std::span<const CsvColumn<ScanRow>> scan_columns() { return kColumns; }

}  // namespace striper::detail
