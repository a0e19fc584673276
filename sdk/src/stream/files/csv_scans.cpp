// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/stream/scan_files.hpp>

#include "stream/files/line_reader.hpp"
#include "stream/files/read_number.hpp"

namespace striper {
namespace {

using detail::ScanColumn;

// What a line says of its scan, and the one return that it is.
struct Line {
  std::uint64_t sequence = 0;
  double time_s = 0.0;
  int laser = 0;
  Return one;

  bool is_of_same_scan(const Line& other) const noexcept {
    return sequence == other.sequence && laser == other.laser && time_s == other.time_s;
  }
};

// Takes the next field off a line; quotes around it go.
std::string_view take_field(std::string_view& rest) {
  const std::size_t comma = rest.find(',');
  std::string_view field = rest.substr(0, comma);
  rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
  const bool is_quoted = field.size() >= 2 && field.starts_with('"') && field.ends_with('"');
  return is_quoted ? field.substr(1, field.size() - 2) : field;
}

class CsvScans : public ScanSource {
 public:
  CsvScans(const std::filesystem::path& path, std::shared_ptr<const StriperModel> model)
      : reader_(path), model_(std::move(model)) {
    read_header();
    pending_ = read_line();
    info_ = head_info(kDefaultHead, source_info(), model_, StripeAxis::kColumns);
  }

  HeadInfo info() const override { return info_; }

  NextStatus next(PolarScan& scan, std::chrono::milliseconds /*timeout*/) override {
    if (!pending_) return NextStatus::kEnd;
    const Line first = *pending_;
    begin(scan, first);
    while (pending_ && pending_->is_of_same_scan(first)) {
      scan.returns.push_back(pending_->one);
      pending_ = read_line();
    }
    conclude(scan);
    return NextStatus::kFrame;
  }

 private:
  enum class Meaning { kNothing, kFrame, kTime, kLaser, kStatus, kNumber };
  struct Column {
    Meaning meaning = Meaning::kNothing;
    const ScanColumn* number = nullptr;
    std::string name;
  };

  SourceInfo source_info() const {
    SourceInfo info;
    info.uri = reader_.path().string();
    info.description = "scans in " + info.uri;
    info.has_clock = pending_ && detail::time_of_seconds(pending_->time_s).utc_offset_ns;
    return info;
  }

  void read_header() {
    std::string header;
    if (!reader_.next(header)) reader_.fail("is empty - expected a header line");
    std::string_view rest = header;
    while (!rest.empty()) columns_.push_back(column_of(take_field(rest)));
    for (const char* const needed : {"frame", "time_s", "bearing_rad", "range_m"}) {
      const bool is_there = std::any_of(columns_.begin(), columns_.end(),
                                        [&](const Column& c) { return c.name == needed; });
      if (!is_there) reader_.fail(fmt::format("there is no column {}: these are no scans", needed));
    }
    const auto has = [&](std::string_view name) {
      return std::any_of(columns_.begin(), columns_.end(),
                         [&](const Column& c) { return c.name == name; });
    };
    has_points_ = has("x_m") && has("y_m");
    has_status_ = has("status");
  }

  static Column column_of(std::string_view name) {
    Column column{Meaning::kNothing, detail::find_scan_column(name), std::string(name)};
    if (column.number != nullptr) column.meaning = Meaning::kNumber;
    if (name == "frame") column.meaning = Meaning::kFrame;
    if (name == "time_s") column.meaning = Meaning::kTime;
    if (name == "laser") column.meaning = Meaning::kLaser;
    if (name == "status") column.meaning = Meaning::kStatus;
    return column;
  }

  std::optional<Line> read_line() {
    if (!reader_.next(text_)) return std::nullopt;
    Line line;
    std::string_view rest = text_;
    std::size_t fields = 0;
    for (const Column& column : columns_) {
      if (fields > 0 && rest.data() == nullptr) break;
      const std::string_view field = take_field(rest);
      ++fields;
      if (!read_field(column, field, line)) {
        reader_.fail(fmt::format("{} is '{}' - expected {}", column.name, field,
                                 column.meaning == Meaning::kStatus ? "a status" : "a number"));
      }
    }
    if (fields != columns_.size() || !rest.empty()) {
      reader_.fail(fmt::format("expected {} fields, as the header has", columns_.size()));
    }
    complete(line.one);
    return line;
  }

  static bool read_field(const Column& column, std::string_view field, Line& line) {
    switch (column.meaning) {
      case Meaning::kFrame:
        return detail::read_number(field, line.sequence);
      case Meaning::kTime:
        return detail::read_number(field, line.time_s);
      case Meaning::kLaser:
        return detail::read_number(field, line.laser);
      case Meaning::kNumber:
        return detail::read_into(field, *column.number, line.one);
      case Meaning::kStatus: {
        const auto status = return_status_from_string(field);
        line.one.status = status.value_or(ReturnStatus::kOk);
        return status.has_value();
      }
      case Meaning::kNothing:
        break;
    }
    return true;
  }

  // What a table made elsewhere leaves out.
  void complete(Return& one) const {
    if (!has_points_) {
      one.x_m = one.range_m * std::cos(one.bearing_rad);
      one.y_m = one.range_m * std::sin(one.bearing_rad);
    }
    if (!has_status_) {
      one.status = std::isfinite(one.range_m) ? ReturnStatus::kOk : ReturnStatus::kNoStripe;
    }
  }

  void begin(PolarScan& scan, const Line& line) {
    scan.sequence = line.sequence;
    scan.time = detail::time_of_seconds(line.time_s);
    scan.laser = line.laser;
    scan.field = Field::kProgressive;
    scan.frame = frame_of(line.laser);
    scan.returns.clear();
  }

  void conclude(PolarScan& scan) const {
    bool is_along_u = true;
    bool is_along_v = true;
    scan.is_stripe_seen = false;
    for (const Return& one : scan.returns) {
      is_along_u = is_along_u && (std::isnan(one.u_px) || one.u_px == std::round(one.u_px));
      is_along_v = is_along_v && one.v_px == std::round(one.v_px);
      scan.is_stripe_seen = scan.is_stripe_seen || one.status == ReturnStatus::kOk;
    }
    scan.axis = !is_along_u && is_along_v ? StripeAxis::kRows : StripeAxis::kColumns;
  }

  const std::shared_ptr<const ScanFrame>& frame_of(int laser) {
    for (const auto& frame : info_.frames) {
      if (frame->laser == laser) return frame;
    }
    return info_.frames.emplace_back(make_scan_frame(kDefaultHead, laser, model_));
  }

  detail::LineReader reader_;
  std::shared_ptr<const StriperModel> model_;
  std::vector<Column> columns_;
  bool has_points_ = true;
  bool has_status_ = true;
  std::string text_;
  std::optional<Line> pending_;
  HeadInfo info_;
};

}  // namespace

std::unique_ptr<ScanSource> read_csv_scans(const std::filesystem::path& path,
                                           std::shared_ptr<const StriperModel> model) {
  return std::make_unique<CsvScans>(path, std::move(model));
}

}  // namespace striper
