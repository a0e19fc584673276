// SPDX-License-Identifier: Apache-2.0
#include <array>

#include <striper/detect/curb_csv.hpp>

namespace striper {
namespace {

constexpr std::array<CsvWord<CurbKind>, 3> kKindWords{{
    {CurbKind::kUp, "up"},
    {CurbKind::kDown, "down"},
    {CurbKind::kRamp, "ramp"},
}};
constexpr std::array<CsvWord<CurbState>, 3> kStateWords{{
    {CurbState::kNew, "new"},
    {CurbState::kTracked, "tracked"},
    {CurbState::kHidden, "hidden"},
}};

template <typename Cell>
constexpr CsvColumn<CurbLine> needed(std::string_view name, Cell cell) {
  return csv_column<CurbLine>(name, cell, CsvNeed::kRequired);
}
template <typename Cell>
constexpr CsvColumn<CurbLine> column(std::string_view name, Cell cell) {
  return csv_column<CurbLine>(name, cell);
}

constexpr std::array kColumns{
    needed(
        "frame", [](auto& r) -> auto& { return r.frame; }),
    needed(
        "time_s", [](auto& r) -> auto& { return r.time_s; }),
    column(
        "head", [](auto& r) -> auto& { return r.head; }),
    column(
        "laser", [](auto& r) -> auto& { return r.laser; }),
    needed(
        "track", [](auto& r) -> auto& { return r.track.id; }),
    needed("kind",
           [](auto& r) {
             return CsvWords{r.track.kind, kKindWords};
           }),
    column("state",
           [](auto& r) {
             return CsvWords{r.track.state, kStateWords};
           }),
    column(
        "foot_x_m", [](auto& r) -> auto& { return r.track.foot_m[0]; }),
    column(
        "foot_y_m", [](auto& r) -> auto& { return r.track.foot_m[1]; }),
    column(
        "top_x_m", [](auto& r) -> auto& { return r.track.top_m[0]; }),
    column(
        "top_y_m", [](auto& r) -> auto& { return r.track.top_m[1]; }),
    needed(
        "lateral_m", [](auto& r) -> auto& { return r.track.lateral_m; }),
    column(
        "sigma_lateral_m", [](auto& r) -> auto& { return r.track.sigma_lateral_m; }),
    column(
        "sigma_cal_lateral_m", [](auto& r) -> auto& { return r.track.sigma_cal_lateral_m; }),
    needed(
        "height_m", [](auto& r) -> auto& { return r.track.height_m; }),
    column(
        "sigma_height_m", [](auto& r) -> auto& { return r.track.sigma_height_m; }),
    column(
        "sigma_cal_height_m", [](auto& r) -> auto& { return r.track.sigma_cal_height_m; }),
    needed(
        "confidence", [](auto& r) -> auto& { return r.track.confidence; }),
};

}  // namespace

std::span<const CsvColumn<CurbLine>> curb_columns() { return kColumns; }

}  // namespace striper
