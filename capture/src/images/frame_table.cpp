// SPDX-License-Identifier: Apache-2.0
#include "images/frame_table.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <system_error>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/event.hpp>

#include "images/decode.hpp"

namespace striper::detail {
namespace {

template <typename Value>
struct Word {
  Value value;
  std::string_view text;
};

constexpr std::array<Word<Field>, 5> kFieldWords{{
    {Field::kProgressive, "progressive"},
    {Field::kTop, "top"},
    {Field::kBottom, "bottom"},
    {Field::kInterlacedTopFirst, "interlaced_top_first"},
    {Field::kInterlacedBottomFirst, "interlaced_bottom_first"},
}};

constexpr std::array<Word<FrameStatus>, 4> kStatusWords{{
    {FrameStatus::kOk, "ok"},
    {FrameStatus::kCorrupt, "corrupt"},
    {FrameStatus::kIncomplete, "incomplete"},
    {FrameStatus::kWrongSize, "wrong_size"},
}};

template <typename Value, std::size_t N>
std::string_view word_of(Value value, const std::array<Word<Value>, N>& words) {
  for (const Word<Value>& word : words) {
    if (word.value == value) return word.text;
  }
  return {};
}

template <typename Value, std::size_t N>
bool parse_word(const std::string& text, const std::array<Word<Value>, N>& words, Value& value) {
  for (const Word<Value>& word : words) {
    if (word.text == text) {
      value = word.value;
      return true;
    }
  }
  return false;
}

template <typename Number>
bool parse_number(const std::string& text, Number& number) {
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  return error == std::errc() && end == last;
}

bool in_range(int value, int low, int high) { return value >= low && value <= high; }

bool parse_offset_px(const std::string& text, double& number) {
  return parse_number(text, number) && std::isfinite(number);
}

bool parse_step_px(const std::string& text, double& number) {
  return parse_offset_px(text, number) && number > 0.0;
}

std::string illumination_word(Illumination illumination) {
  if (illumination.is_unknown()) return {};
  return illumination.is_dark() ? "dark" : std::to_string(illumination.laser_index());
}

bool parse_cadence(const std::string& text, Cadence& cadence) {
  try {
    cadence = Cadence::parse(text);
    return true;
  } catch (const Error&) {
    return false;
  }
}

bool parse_illumination(const std::string& text, Illumination& illumination) {
  Cadence single;
  if (text.empty()) {
    illumination = Illumination::unknown();
  } else if (text == "dark") {
    illumination = Illumination::dark();
  } else if (parse_cadence(text, single) && single.pattern().size() == 1) {
    illumination = single.at(0);
  } else {
    return false;
  }
  return true;
}

// A clock's value, an offset and a field's delay are added up: together they stay below 2^63.
bool parse_ns(const std::string& text, std::int64_t& value) {
  constexpr std::int64_t kMost_ns = 3'000'000'000'000'000'000;  // 95 years.
  return parse_number(text, value) && value >= -kMost_ns && value <= kMost_ns;
}

bool parse_offset(const std::string& text, std::optional<std::int64_t>& offset) {
  if (text.empty()) {
    offset.reset();
    return true;
  }
  return parse_ns(text, offset.emplace());
}

// The table's columns: name, how a frame is written, how it is read back (false: not a value).
struct Column {
  std::string_view name;
  std::string (*format)(const FrameRow&);
  bool (*parse)(const std::string&, FrameRow&);
};

const std::array<Column, 21> kColumns{{
    {"file", [](const FrameRow& r) { return r.file; },
     [](const std::string& text, FrameRow& r) {
       r.file = text;
       return text.find('/') == std::string::npos;  // Never out of the recording's directory.
     }},
    {"sequence", [](const FrameRow& r) { return std::to_string(r.frame.sequence); },
     [](const std::string& text, FrameRow& r) { return parse_number(text, r.frame.sequence); }},
    {"exposure_in_picture",
     [](const FrameRow& r) { return std::to_string(r.frame.exposure_in_picture); },
     [](const std::string& text, FrameRow& r) {
       int& value = r.frame.exposure_in_picture;
       return parse_number(text, value) && in_range(value, 0, 1);
     }},
    {"exposures_per_picture",
     [](const FrameRow& r) { return std::to_string(r.frame.exposures_per_picture); },
     [](const std::string& text, FrameRow& r) {
       int& value = r.frame.exposures_per_picture;
       return parse_number(text, value) && in_range(value, 1, 2);
     }},
    {"monotonic_ns", [](const FrameRow& r) { return std::to_string(r.frame.time.monotonic_ns); },
     [](const std::string& text, FrameRow& r) {
       return parse_ns(text, r.frame.time.monotonic_ns);
     }},
    {"utc_offset_ns",
     [](const FrameRow& r) {
       const auto& offset = r.frame.time.utc_offset_ns;
       return offset ? std::to_string(*offset) : std::string();
     },
     [](const std::string& text, FrameRow& r) {
       return parse_offset(text, r.frame.time.utc_offset_ns);
     }},
    {"field_period_ns", [](const FrameRow& r) { return std::to_string(r.frame.field_period_ns); },
     [](const std::string& text, FrameRow& r) { return parse_ns(text, r.frame.field_period_ns); }},
    {"exposure_ns", [](const FrameRow& r) { return std::to_string(r.frame.exposure_ns); },
     [](const std::string& text, FrameRow& r) { return parse_ns(text, r.frame.exposure_ns); }},
    {"illumination", [](const FrameRow& r) { return illumination_word(r.frame.illumination); },
     [](const std::string& text, FrameRow& r) {
       return parse_illumination(text, r.frame.illumination);
     }},
    {"field", [](const FrameRow& r) { return std::string(word_of(r.frame.field, kFieldWords)); },
     [](const std::string& text, FrameRow& r) {
       return parse_word(text, kFieldWords, r.frame.field);
     }},
    {"bit_depth", [](const FrameRow& r) { return std::to_string(r.frame.bit_depth); },
     [](const std::string& text, FrameRow& r) {
       return parse_number(text, r.frame.bit_depth) && in_range(r.frame.bit_depth, 8, 16);
     }},
    {"sensor_width", [](const FrameRow& r) { return std::to_string(r.frame.sensor_size.width); },
     [](const std::string& text, FrameRow& r) {
       return parse_number(text, r.frame.sensor_size.width) && r.frame.sensor_size.width >= 0;
     }},
    {"sensor_height", [](const FrameRow& r) { return std::to_string(r.frame.sensor_size.height); },
     [](const std::string& text, FrameRow& r) {
       return parse_number(text, r.frame.sensor_size.height) && r.frame.sensor_size.height >= 0;
     }},
    {"grid_u_offset", [](const FrameRow& r) { return fmt::format("{}", r.frame.grid.u.offset); },
     [](const std::string& text, FrameRow& r) {
       return parse_offset_px(text, r.frame.grid.u.offset);
     }},
    {"grid_u_step", [](const FrameRow& r) { return fmt::format("{}", r.frame.grid.u.step); },
     [](const std::string& text, FrameRow& r) { return parse_step_px(text, r.frame.grid.u.step); }},
    {"grid_v_offset", [](const FrameRow& r) { return fmt::format("{}", r.frame.grid.v.offset); },
     [](const std::string& text, FrameRow& r) {
       return parse_offset_px(text, r.frame.grid.v.offset);
     }},
    {"grid_v_step", [](const FrameRow& r) { return fmt::format("{}", r.frame.grid.v.step); },
     [](const std::string& text, FrameRow& r) { return parse_step_px(text, r.frame.grid.v.step); }},
    {"cadence", [](const FrameRow& r) { return r.cadence.to_string(); },
     [](const std::string& text, FrameRow& r) { return parse_cadence(text, r.cadence); }},
    {"epoch", [](const FrameRow& r) { return std::to_string(r.frame.epoch); },
     [](const std::string& text, FrameRow& r) { return parse_number(text, r.frame.epoch); }},
    {"status", [](const FrameRow& r) { return std::string(word_of(r.frame.status, kStatusWords)); },
     [](const std::string& text, FrameRow& r) {
       return parse_word(text, kStatusWords, r.frame.status);
     }},
    {"detail", [](const FrameRow& r) { return r.frame.status_detail; },
     [](const std::string& text, FrameRow& r) {
       r.frame.status_detail = text;
       return true;
     }},
}};

// RFC 4180: quoted where it must be. Line ends within a field would make a cut line look whole.
std::string quoted(std::string text) {
  for (char& c : text) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"') result += '"';
    result += c;
  }
  return result + '"';
}

std::vector<std::string> split_line(std::string_view line) {
  std::vector<std::string> fields(1);
  bool in_quotes = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (in_quotes && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      fields.back() += c;
      ++i;
    } else if (c == '"') {
      in_quotes = !in_quotes;
    } else if (c == ',' && !in_quotes) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

struct Line {
  std::string_view text;
  std::size_t number = 0;  // In the file, from 1.
  bool is_whole = true;    // It has its line end.
};

std::vector<Line> split_lines(std::string_view text) {
  std::vector<Line> lines;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (!line.empty()) lines.push_back({line, number, end != std::string_view::npos});
  }
  return lines;
}

// Which of kColumns each field of the file is; null for a column that we do not know.
std::vector<const Column*> read_header(const Line& line, const std::string& file) {
  std::vector<const Column*> columns;
  bool has_file = false;
  for (const std::string& name : split_line(line.text)) {
    const Column* known = nullptr;
    for (const Column& column : kColumns) {
      if (column.name == name) known = &column;
    }
    has_file = has_file || name == kColumns.front().name;
    columns.push_back(known);
  }
  if (!has_file) {
    throw Error(ErrorKind::kBadFile,
                fmt::format("'{}': the header has no column 'file': it is no frame table", file));
  }
  return columns;
}

void read_row(const std::vector<const Column*>& columns, const std::vector<std::string>& fields,
              FrameRow& row, const std::string& where) {
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (columns[i] != nullptr && !columns[i]->parse(fields[i], row)) {
      throw Error(ErrorKind::kBadFile, fmt::format("{}: column '{}' cannot be '{}'", where,
                                                   columns[i]->name, fields[i]));
    }
  }
}

std::string read_text(const std::filesystem::path& path) {
  std::vector<std::uint8_t> bytes;
  if (const int failure = read_whole_file(path, bytes); failure != 0) {
    throw Error(ErrorKind::kIo,
                fmt::format("'{}': {}", path.string(), std::generic_category().message(failure)));
  }
  return {bytes.begin(), bytes.end()};
}

}  // namespace

std::string format_frame_table_header() {
  std::string line;
  for (const Column& column : kColumns) {
    if (!line.empty()) line += ',';
    line += column.name;
  }
  return line + "\n";
}

std::string format_frame_row(const FrameRow& row) {
  std::string line;
  for (const Column& column : kColumns) {
    if (&column != &kColumns.front()) line += ',';
    line += quoted(column.format(row));
  }
  return line + "\n";
}

std::vector<FrameRow> read_frame_table(const std::filesystem::path& path,
                                       std::int64_t default_period_ns, const EventPort& events) {
  const std::string text = read_text(path);
  const std::vector<Line> lines = split_lines(text);
  if (lines.empty()) {
    throw Error(ErrorKind::kBadFile, fmt::format("'{}' is empty: no header line", path.string()));
  }
  const std::vector<const Column*> columns = read_header(lines.front(), path.string());

  std::vector<FrameRow> rows;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::string where = fmt::format("'{}' line {}", path.string(), lines[i].number);
    const std::vector<std::string> fields = split_line(lines[i].text);
    if (!lines[i].is_whole && fields.size() < columns.size()) {
      events.send({"recording_cut", where + " was cut off and is left out"});
      break;
    }
    if (fields.size() != columns.size()) {
      throw Error(ErrorKind::kBadFile, fmt::format("{}: {} fields, but the header has {}", where,
                                                   fields.size(), columns.size()));
    }
    FrameRow& row = rows.emplace_back();
    row.frame.sequence = i - 1;
    row.frame.time.monotonic_ns = static_cast<std::int64_t>(i - 1) * default_period_ns;
    read_row(columns, fields, row, where);
  }
  return rows;
}

}  // namespace striper::detail
