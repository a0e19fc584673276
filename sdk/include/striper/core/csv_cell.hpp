// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

namespace striper {

/// How one value stands in a table's cell. Three functions make a type one that a table can hold:
/// `write_cell` appends its text, `read_cell` takes it from text (false: it cannot be that),
/// `expected_cell` says for messages what can stand there. A type of one's own gets them in its own
/// namespace.
///
/// Numbers are the shortest text that reads back to the same bits, infinity is `inf`, and what does
/// not exist (NaN, an empty optional) is an empty cell; the text `nan` is refused. Nothing is
/// allocated but what `out` grows by. Thread-safe.
void write_cell(std::string& out, double value);
void write_cell(std::string& out, float value);
void write_cell(std::string& out, std::int64_t value);
void write_cell(std::string& out, std::uint64_t value);

/// In quotes where RFC 4180 wants them. A line end becomes a space: a row is a line, always.
void write_cell(std::string& out, std::string_view text);

template <std::integral Number>
void write_cell(std::string& out, Number value) {
  using Widest = std::conditional_t<std::is_signed_v<Number>, std::int64_t, std::uint64_t>;
  write_cell(out, static_cast<Widest>(value));
}

bool read_cell(std::string_view text, double& value) noexcept;
bool read_cell(std::string_view text, float& value) noexcept;
bool read_cell(std::string_view text, std::int64_t& value) noexcept;
bool read_cell(std::string_view text, std::uint64_t& value) noexcept;
bool read_cell(std::string_view text, std::string& value);

template <std::integral Number>
bool read_cell(std::string_view text, Number& value) noexcept {
  std::conditional_t<std::is_signed_v<Number>, std::int64_t, std::uint64_t> widest = 0;
  if (!read_cell(text, widest)) return false;
  value = static_cast<Number>(widest);
  return static_cast<decltype(widest)>(value) == widest;
}

std::string expected_cell(double value);
std::string expected_cell(float value);
std::string expected_cell(const std::string& value);
std::string expected_whole_number(bool may_be_negative);
std::string expected_between(double least, double most, bool is_whole);
std::string expected_one_of(const std::string_view* words, std::size_t count);

template <std::integral Number>
std::string expected_cell(Number) {
  return expected_whole_number(std::is_signed_v<Number>);
}

template <typename Value>
void write_cell(std::string& out, const std::optional<Value>& value) {
  if (value) write_cell(out, *value);
}
template <typename Value>
bool read_cell(std::string_view text, std::optional<Value>& value) {
  value.reset();
  return text.empty() || read_cell(text, value.emplace());
}
template <typename Value>
std::string expected_cell(const std::optional<Value>&) {
  return expected_cell(Value{}) + " or nothing";
}

/// A number that must be there, finite and within bounds.
template <typename Number>
struct CsvBetween {
  Number& value;
  std::remove_const_t<Number> least;
  std::remove_const_t<Number> most;
};
template <typename Number>
CsvBetween(Number&, std::remove_const_t<Number>, std::remove_const_t<Number>) -> CsvBetween<Number>;

template <typename Number>
void write_cell(std::string& out, const CsvBetween<Number>& cell) {
  write_cell(out, cell.value);
}
template <typename Number>
bool read_cell(std::string_view text, CsvBetween<Number> cell) {
  return read_cell(text, cell.value) && cell.value >= cell.least && cell.value <= cell.most;
}
template <typename Number>
std::string expected_cell(const CsvBetween<Number>& cell) {
  return expected_between(static_cast<double>(cell.least), static_cast<double>(cell.most),
                          std::is_integral_v<std::remove_const_t<Number>>);
}

/// One of an enumeration's values, each with its word.
template <typename Value>
struct CsvWord {
  Value value;
  std::string_view text;
};
template <typename Value, std::size_t kCount>
struct CsvWords {
  Value& value;
  const std::array<CsvWord<std::remove_const_t<Value>>, kCount>& words;
};
template <typename Value, std::size_t kCount>
CsvWords(Value&, const std::array<CsvWord<std::remove_const_t<Value>>, kCount>&)
    -> CsvWords<Value, kCount>;

template <typename Value, std::size_t kCount>
void write_cell(std::string& out, const CsvWords<Value, kCount>& cell) {
  for (const auto& word : cell.words) {
    if (word.value == cell.value) return write_cell(out, word.text);
  }
}
template <typename Value, std::size_t kCount>
bool read_cell(std::string_view text, CsvWords<Value, kCount> cell) {
  for (const auto& word : cell.words) {
    if (word.text != text) continue;
    cell.value = word.value;
    return true;
  }
  return false;
}
template <typename Value, std::size_t kCount>
std::string expected_cell(const CsvWords<Value, kCount>& cell) {
  std::array<std::string_view, kCount> words;
  for (std::size_t i = 0; i < kCount; ++i) words[i] = cell.words[i].text;
  return expected_one_of(words.data(), kCount);
}

}  // namespace striper
