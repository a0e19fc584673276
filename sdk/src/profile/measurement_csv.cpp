// SPDX-License-Identifier: Apache-2.0
#include <array>

#include <striper/profile/measurement_csv.hpp>

namespace striper {
namespace {

constexpr std::array<CsvWord<MeasureStatus>, 5> kStatusWords{{
    {MeasureStatus::kOk, "ok"},
    {MeasureStatus::kNoLine, "no_line"},
    {MeasureStatus::kFewPoints, "few_points"},
    {MeasureStatus::kAmbiguous, "ambiguous"},
    {MeasureStatus::kOutside, "outside"},
}};

constexpr std::array<CsvWord<std::string_view>, 3> kUnitWords{
    {{"m", "m"}, {"rad", "rad"}, {"m2", "m2"}}};

constexpr std::array kColumns{
    csv_column<MeasurementLine>(
        "frame", [](auto& r) -> auto& { return r.frame; }, CsvNeed::kRequired),
    csv_column<MeasurementLine>(
        "time_s", [](auto& r) -> auto& { return r.time_s; }, CsvNeed::kRequired),
    csv_column<MeasurementLine>(
        "tool", [](auto& r) -> auto& { return r.measurement.tool; }, CsvNeed::kRequired),
    csv_column<MeasurementLine>(
        "value", [](auto& r) -> auto& { return r.measurement.value; }, CsvNeed::kRequired),
    csv_column<MeasurementLine>(
        "sigma", [](auto& r) -> auto& { return r.measurement.sigma; }),
    csv_column<MeasurementLine>(
        "sigma_cal", [](auto& r) -> auto& { return r.measurement.sigma_cal; }),
    csv_column<MeasurementLine>("unit",
                                [](auto& r) {
                                  return CsvWords{r.measurement.unit, kUnitWords};
                                }),
    csv_column<MeasurementLine>(
        "points", [](auto& r) -> auto& { return r.measurement.points; }),
    csv_column<MeasurementLine>("status",
                                [](auto& r) {
                                  return CsvWords{r.measurement.status, kStatusWords};
                                }),
};

}  // namespace

std::span<const CsvColumn<MeasurementLine>> measurement_columns() { return kColumns; }

std::string_view to_string(MeasureStatus status) noexcept {
  for (const auto& word : kStatusWords)
    if (word.value == status) return word.text;
  return {};
}

}  // namespace striper
