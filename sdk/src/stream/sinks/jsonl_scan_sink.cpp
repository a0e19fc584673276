// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <striper/core/append_file.hpp>
#include <striper/core/whole_file.hpp>

#include "scan/scan_columns.hpp"
#include "stream/sinks/built_in.hpp"

namespace striper {
namespace {

constexpr std::string_view kScanBegins = "{\"head\":";
constexpr std::string_view kEventBegins = "{\"event\":";
constexpr std::string_view kCurbsBegin = "{\"curbs\":";
constexpr std::string_view kObjectsBegin = "{\"objects\":";

void append_text(std::string& out, std::string_view text) {
  out += '"';
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20) {
      fmt::format_to(std::back_inserter(out), "\\u{:04x}", static_cast<int>(c));
    } else {
      out += c;
    }
  }
  out += '"';
}

// The shortest text that reads back to the same bits; JSON has neither NaN nor infinity.
template <typename Number>
void append_number(std::string& out, Number value) {
  if (std::isnan(value)) {
    out += "null";
  } else if (std::isinf(value)) {
    out += value > 0 ? "\"inf\"" : "\"-inf\"";
  } else {
    fmt::format_to(std::back_inserter(out), "{}", value);
  }
}

void append_key(std::string& out, std::string_view key) {
  out += ",\"";
  out += key;
  out += "\":";
}

// [a,b,...]: what `append_one` writes for each return.
template <typename AppendOne>
void append_array(std::string& out, const PolarScan& scan, AppendOne append_one) {
  char separator = '[';
  for (const Return& one : scan.returns) {
    out += separator;
    append_one(one);
    separator = ',';
  }
  if (scan.returns.empty()) out += '[';
  out += ']';
}

void append_scan(std::string& out, const PolarScan& scan) {
  out += kScanBegins;
  append_text(out, scan.head());
  fmt::format_to(std::back_inserter(out), ",\"laser\":{},\"sequence\":{},\"time_s\":{}", scan.laser,
                 scan.sequence, scan.time.seconds());
  append_key(out, "frame_id");
  append_text(out, scan.frame ? std::string_view(scan.frame->frame_id) : std::string_view());
  append_key(out, "axis");
  append_text(out, to_string(scan.axis));
  const bool is_field = scan.field == Field::kTop || scan.field == Field::kBottom;
  if (is_field) {
    append_key(out, "field");
    append_text(out, scan.field == Field::kTop ? "top" : "bottom");
  }
  if (!scan.is_stripe_seen) out += ",\"is_stripe_seen\":false";
  append_key(out, "status");
  append_array(out, scan, [&](const Return& one) { append_text(out, to_string(one.status)); });
  for (const detail::ScanColumn& column : detail::kScanColumns) {
    append_key(out, column.name);
    std::visit(
        [&](auto member) {
          append_array(out, scan, [&](const Return& one) { append_number(out, one.*member); });
        },
        column.member);
  }
  out += "}\n";
}

void append_event(std::string& out, const Event& event) {
  out += kEventBegins;
  append_text(out, event.code.word());
  append_key(out, "severity");
  append_text(out, to_string(event.severity));
  append_key(out, "head");
  append_text(out, event.head);
  append_key(out, "time_s");
  append_number(out, event.time_s);
  append_key(out, "message");
  append_text(out, event.message);
  append_key(out, "advice");
  append_text(out, event.advice);
  out += "}\n";
}

// A cell of a table as JSON: text in quotes, numbers as they are, but for what JSON lacks.
template <typename Row>
void append_cell(std::string& out, const CsvColumn<Row>& column, const Row& row,
                 std::string& cell) {
  cell.clear();
  column.write(cell, row);
  const bool is_infinite = cell == "inf" || cell == "-inf";
  if (column.is_text || is_infinite) {
    append_text(out, cell);
  } else {
    out += cell.empty() ? "null" : cell;
  }
}

// {"curbs":[{...}],"head":...}: of each line its columns behind those that say which scan.
template <typename Row>
void append_found(std::string& out, std::string_view begins, const ScanStamp& scan,
                  std::span<const CsvColumn<Row>> columns, const std::vector<Row>& rows) {
  constexpr std::size_t kOfScan = 4;
  out += begins;
  out += '[';
  std::string cell;
  for (const Row& row : rows) {
    if (&row != &rows.front()) out += ',';
    char separator = '{';
    for (const auto& column : columns.subspan(kOfScan)) {
      out += std::exchange(separator, ',');
      append_text(out, column.name);
      out += ':';
      append_cell(out, column, row, cell);
    }
    out += '}';
  }
  out += "],\"head\":";
  append_text(out, scan.head);
  fmt::format_to(std::back_inserter(out), ",\"laser\":{},\"sequence\":{},\"time_s\":{}", scan.laser,
                 scan.sequence, scan.time.seconds());
  append_key(out, "frame_id");
  append_text(out, scan.frame_id);
  out += "}\n";
}

// A line of JSON per scan, event and what was found in a scan.
class JsonlScanSink : public ScanSink {
 public:
  using ScanSink::write;

  explicit JsonlScanSink(std::string path) : path_(std::move(path)) {
    require_replaceable(path_, {kScanBegins, kEventBegins, kCurbsBegin, kObjectsBegin}, "scans");
  }

  void open(const HeadInfo& /*head*/) override {
    if (file_) return;
    file_.emplace(path_);
    file_->lines() = early_;
    file_->flush();
  }

  void write(const PolarScan& scan) override {
    append_scan(file_->lines(), scan);
    file_->flush();
  }

  void event(const Event& event) override {
    append_event(file_ ? file_->lines() : early_, event);
    if (file_) file_->flush();
  }

  void curbs(const CurbsSeen& seen) override {
    append_found(file_->lines(), kCurbsBegin, seen.scan, curb_columns(), seen.lines);
    file_->flush();
  }

  void objects(const ObjectsSeen& seen) override {
    append_found(file_->lines(), kObjectsBegin, seen.scan, object_columns(), seen.lines);
    file_->flush();
  }

  void finish() override {
    if (file_) file_->close();
  }

 private:
  std::string path_;
  std::string early_;  // Events from before the first head: no file gives way to them.
  std::optional<AppendFile> file_;
};

}  // namespace

// NOLINTNEXTLINE(performance-unnecessary-value-param): as all that make sinks.
std::unique_ptr<ScanSink> detail::make_jsonl_sink(SinkUri uri) {
  uri.refuse_unused("nothing");
  return std::make_unique<JsonlScanSink>(uri.path());
}

}  // namespace striper
