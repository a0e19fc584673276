// SPDX-License-Identifier: Apache-2.0
#include "images/frame_table.hpp"

#include <array>
#include <limits>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/event.hpp>

namespace striper::detail {
namespace {

constexpr std::array<CsvWord<Field>, 5> kFieldWords{{
    {Field::kProgressive, "progressive"},
    {Field::kTop, "top"},
    {Field::kBottom, "bottom"},
    {Field::kInterlacedTopFirst, "interlaced_top_first"},
    {Field::kInterlacedBottomFirst, "interlaced_bottom_first"},
}};

constexpr std::array<CsvWord<FrameStatus>, 4> kStatusWords{{
    {FrameStatus::kOk, "ok"},
    {FrameStatus::kCorrupt, "corrupt"},
    {FrameStatus::kIncomplete, "incomplete"},
    {FrameStatus::kWrongSize, "wrong_size"},
}};

// An image file's name: never out of the recording's directory.
template <typename Text>
struct NameCell {
  Text& name;
};
template <typename Text>
NameCell(Text&) -> NameCell<Text>;
template <typename Text>
void write_cell(std::string& out, const NameCell<Text>& cell) {
  striper::write_cell(out, cell.name);
}
bool read_cell(std::string_view text, NameCell<std::string> cell) {
  cell.name = text;
  return text.find('/') == std::string_view::npos;
}
template <typename Text>
std::string expected_cell(const NameCell<Text>&) {
  return "the name of a file beside the table";
}

bool parse_pattern(std::string_view text, IlluminationPattern& pattern) {
  try {
    pattern = IlluminationPattern::parse(std::string(text));
    return true;
  } catch (const Error&) {
    return false;
  }
}

template <typename Value>
struct PatternCell {
  Value& value;
};
template <typename Value>
PatternCell(Value&) -> PatternCell<Value>;
template <typename Value>
void write_cell(std::string& out, const PatternCell<Value>& cell) {
  striper::write_cell(out, cell.value.to_string());
}
bool read_cell(std::string_view text, PatternCell<IlluminationPattern> cell) {
  return parse_pattern(text, cell.value);
}
template <typename Value>
std::string expected_cell(const PatternCell<Value>&) {
  return "a pattern as in laser=";
}

template <typename Value>
struct IlluminationCell {
  Value& value;
};
template <typename Value>
IlluminationCell(Value&) -> IlluminationCell<Value>;
template <typename Value>
void write_cell(std::string& out, const IlluminationCell<Value>& cell) {
  if (cell.value.is_dark()) out += "dark";
  if (cell.value.is_lit()) striper::write_cell(out, cell.value.laser_index());
}
bool read_cell(std::string_view text, IlluminationCell<Illumination> cell) {
  cell.value = text == "dark" ? Illumination::dark() : Illumination::unknown();
  if (text.empty() || text == "dark") return true;
  IlluminationPattern single;
  if (!parse_pattern(text, single) || single.entries().size() != 1) return false;
  cell.value = single.at(0);
  return true;
}
template <typename Value>
std::string expected_cell(const IlluminationCell<Value>&) {
  return "dark, the index of a laser, or nothing";
}

// A clock's value, an offset and a field's delay are added up: together they stay below 2^63.
constexpr std::int64_t kMost_ns = 3'000'000'000'000'000'000;  // 95 years.

template <typename Value>
auto ns_cell(Value& value) {
  return CsvBetween{value, -kMost_ns, kMost_ns};
}

template <typename Value>
struct OffsetCell {
  Value& value;
};
template <typename Value>
OffsetCell(Value&) -> OffsetCell<Value>;
template <typename Value>
void write_cell(std::string& out, const OffsetCell<Value>& cell) {
  striper::write_cell(out, cell.value);
}
bool read_cell(std::string_view text, OffsetCell<std::optional<std::int64_t>> cell) {
  cell.value.reset();
  return text.empty() || striper::read_cell(text, ns_cell(cell.value.emplace()));
}
template <typename Value>
std::string expected_cell(const OffsetCell<Value>&) {
  return "nanoseconds, or nothing";
}

constexpr double kMost = std::numeric_limits<double>::max();
constexpr int kMostPixels = std::numeric_limits<int>::max();

template <typename Value>
auto offset_cell(Value& value) {
  return CsvBetween{value, -kMost, kMost};
}
template <typename Value>
auto step_cell(Value& value) {
  return CsvBetween{value, std::numeric_limits<double>::denorm_min(), kMost};
}

template <typename Cell>
constexpr CsvColumn<FrameRow> column(std::string_view name, Cell cell,
                                     CsvNeed need = CsvNeed::kOptional) {
  return csv_column<FrameRow>(name, cell, need);
}

constexpr std::array kColumns{
    column(
        "file", [](auto& r) { return NameCell{r.file}; }, CsvNeed::kRequired),
    column(
        "sequence", [](auto& r) -> auto& { return r.frame.sequence; }),
    column("exposure_in_picture",
           [](auto& r) {
             return CsvBetween{r.frame.exposure_in_picture, 0, 1};
           }),
    column("exposures_per_picture",
           [](auto& r) {
             return CsvBetween{r.frame.exposures_per_picture, 1, 2};
           }),
    column("monotonic_ns", [](auto& r) { return ns_cell(r.frame.time.monotonic_ns); }),
    column("utc_offset_ns", [](auto& r) { return OffsetCell{r.frame.time.utc_offset_ns}; }),
    column("field_period_ns", [](auto& r) { return ns_cell(r.frame.field_period_ns); }),
    column("exposure_ns", [](auto& r) { return ns_cell(r.frame.exposure_ns); }),
    column("illumination", [](auto& r) { return IlluminationCell{r.frame.illumination}; }),
    column("field",
           [](auto& r) {
             return CsvWords{r.frame.field, kFieldWords};
           }),
    column("bit_depth",
           [](auto& r) {
             return CsvBetween{r.frame.bit_depth, 8, 16};
           }),
    column("sensor_width",
           [](auto& r) {
             return CsvBetween{r.frame.sensor_size.width, 0, kMostPixels};
           }),
    column("sensor_height",
           [](auto& r) {
             return CsvBetween{r.frame.sensor_size.height, 0, kMostPixels};
           }),
    column("grid_u_offset", [](auto& r) { return offset_cell(r.frame.grid.u.offset); }),
    column("grid_u_step", [](auto& r) { return step_cell(r.frame.grid.u.step); }),
    column("grid_v_offset", [](auto& r) { return offset_cell(r.frame.grid.v.offset); }),
    column("grid_v_step", [](auto& r) { return step_cell(r.frame.grid.v.step); }),
    column("cadence", [](auto& r) { return PatternCell{r.pattern}; }),
    column(
        "epoch", [](auto& r) -> auto& { return r.frame.epoch; }),
    column("status",
           [](auto& r) {
             return CsvWords{r.frame.status, kStatusWords};
           }),
    column(
        "detail", [](auto& r) -> auto& { return r.frame.status_detail; }),
    column(
        "encoder_counts", [](auto& r) -> auto& { return r.frame.encoder_counts; }),
};

}  // namespace

std::span<const CsvColumn<FrameRow>> frame_columns() { return kColumns; }

std::vector<FrameRow> read_frame_table(const std::filesystem::path& path,
                                       std::int64_t default_period_ns, const EventPort& events) {
  CsvReader<FrameRow> reader(CsvInput::open(path), kColumns, "frame table");
  std::vector<FrameRow> rows;
  while (true) {
    FrameRow row;
    row.frame.sequence = rows.size();
    row.frame.time.monotonic_ns = static_cast<std::int64_t>(rows.size()) * default_period_ns;
    if (!reader.next(row)) break;
    rows.push_back(std::move(row));
  }
  if (reader.cut_line() > 0) {
    events.send({"recording_cut", fmt::format("'{}' line {} was cut off and is left out",
                                              path.string(), reader.cut_line())});
  }
  return rows;
}

}  // namespace striper::detail
