// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>

#include <striper/detect/object_csv.hpp>

namespace striper {
namespace {

constexpr std::array<CsvWord<ObjectZone>, 3> kZoneWords{{
    {ObjectZone::kUnknown, "unknown"},
    {ObjectZone::kRoad, "road"},
    {ObjectZone::kBehindCurb, "behind_curb"},
}};

template <typename Cell>
constexpr CsvColumn<ObjectLine> needed(std::string_view name, Cell cell) {
  return csv_column<ObjectLine>(name, cell, CsvNeed::kRequired);
}
template <typename Cell>
constexpr CsvColumn<ObjectLine> column(std::string_view name, Cell cell) {
  return csv_column<ObjectLine>(name, cell);
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
    needed(
        "x_m", [](auto& r) -> auto& { return r.track.position_m[0]; }),
    needed(
        "y_m", [](auto& r) -> auto& { return r.track.position_m[1]; }),
    column(
        "sigma_x_m", [](auto& r) -> auto& { return r.sigma_x_m; }),
    column(
        "sigma_y_m", [](auto& r) -> auto& { return r.sigma_y_m; }),
    column(
        "corr_xy", [](auto& r) -> auto& { return r.corr_xy; }),
    column(
        "bearing_rad", [](auto& r) -> auto& { return r.bearing_rad; }),
    column(
        "range_m", [](auto& r) -> auto& { return r.range_m; }),
    column(
        "width_m", [](auto& r) -> auto& { return r.track.width_m; }),
    column(
        "vx_m_s", [](auto& r) -> auto& { return r.track.velocity_m_s[0]; }),
    column(
        "vy_m_s", [](auto& r) -> auto& { return r.track.velocity_m_s[1]; }),
    column(
        "sigma_v_m_s", [](auto& r) -> auto& { return r.track.sigma_v_m_s; }),
    column(
        "observable_rad", [](auto& r) -> auto& { return r.track.observable_rad; }),
    column(
        "closing_m_s", [](auto& r) -> auto& { return r.track.closing_m_s; }),
    column(
        "time_to_contact_s", [](auto& r) -> auto& { return r.track.time_to_contact_s; }),
    column(
        "ttc_low_s", [](auto& r) -> auto& { return r.track.ttc_low_s; }),
    column(
        "ttc_high_s", [](auto& r) -> auto& { return r.track.ttc_high_s; }),
    column("zone",
           [](auto& r) {
             return CsvWords{r.track.zone, kZoneWords};
           }),
    column(
        "confidence", [](auto& r) -> auto& { return r.track.confidence; }),
};

}  // namespace

std::span<const CsvColumn<ObjectLine>> object_columns() { return kColumns; }

void ObjectLine::set(const ObjectTrack& now) {
  track = now;
  sigma_x_m = std::sqrt(now.covariance(0, 0));
  sigma_y_m = std::sqrt(now.covariance(1, 1));
  corr_xy = now.covariance(0, 1) / (sigma_x_m * sigma_y_m);
  bearing_rad = std::atan2(now.position_m.y(), now.position_m.x());
  range_m = now.position_m.norm();
}

}  // namespace striper
