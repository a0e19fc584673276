// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/core/csv_cell.hpp>

namespace striper {
namespace {

// The longest shortest text of a double is 24 characters, of a 64-bit whole number 20.
constexpr std::size_t kLongestNumber = 32;

template <typename Number>
void write_number(std::string& out, Number value) {
  char text[kLongestNumber];
  const auto* const end = fmt::format_to(text, "{}", value);
  out.append(text, static_cast<std::size_t>(end - text));
}

template <typename Number>
bool parse(std::string_view text, Number& value) noexcept {
  const char* const last = text.data() + text.size();
  const auto [end, failure] = std::from_chars(text.data(), last, value);
  return failure == std::errc() && end == last;
}

// from_chars also takes `nan` and `infinity`, in any case: here infinity has one name, NaN none.
template <typename Real>
bool parse_real(std::string_view text, Real& value) noexcept {
  if (text.empty()) {
    value = std::numeric_limits<Real>::quiet_NaN();
    return true;
  }
  if (text == "inf" || text == "-inf") {
    value =
        std::copysign(std::numeric_limits<Real>::infinity(), text == "inf" ? Real{1} : Real{-1});
    return true;
  }
  return parse(text, value) && std::isfinite(value);
}

}  // namespace

void write_cell(std::string& out, double value) {
  if (!std::isnan(value)) write_number(out, value);
}
void write_cell(std::string& out, float value) {
  if (!std::isnan(value)) write_number(out, value);
}
void write_cell(std::string& out, std::int64_t value) { write_number(out, value); }
void write_cell(std::string& out, std::uint64_t value) { write_number(out, value); }

void write_cell(std::string& out, std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
    out += text;
    return;
  }
  const bool is_quoted = text.find_first_of(",\"") != std::string_view::npos;
  if (is_quoted) out += '"';
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c == '\n' || c == '\r' ? ' ' : c;
  }
  if (is_quoted) out += '"';
}

bool read_cell(std::string_view text, double& value) noexcept { return parse_real(text, value); }
bool read_cell(std::string_view text, float& value) noexcept { return parse_real(text, value); }
bool read_cell(std::string_view text, std::int64_t& value) noexcept { return parse(text, value); }
bool read_cell(std::string_view text, std::uint64_t& value) noexcept { return parse(text, value); }
bool read_cell(std::string_view text, std::string& value) {
  value = text;
  return true;
}

std::string expected_cell(double) { return "a number, inf or nothing"; }
std::string expected_cell(float) { return "a number, inf or nothing"; }
std::string expected_cell(const std::string&) { return "text"; }
std::string expected_whole_number(bool may_be_negative) {
  return may_be_negative ? "a whole number" : "a whole number from 0";
}

std::string expected_between(double least, double most, bool is_whole) {
  const char* const what = is_whole ? "a whole number" : "a finite number";
  constexpr double kAny = std::numeric_limits<double>::max();
  if (least <= -kAny && most >= kAny) return what;
  if (least == std::numeric_limits<double>::denorm_min()) return fmt::format("{} above 0", what);
  if (most >= kAny) return fmt::format("{} from {}", what, least);
  return fmt::format("{} from {} to {}", what, least, most);
}

std::string expected_one_of(const std::string_view* words, std::size_t count) {
  return fmt::format("one of {}", fmt::join(words, words + count, ", "));
}

}  // namespace striper
