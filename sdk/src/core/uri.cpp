// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/illumination_pattern.hpp>
#include <striper/core/uri.hpp>

namespace striper {
namespace {

bool is_key_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.' || c == '-';
}

bool begins_with_key(std::string_view text) {
  const auto end = std::find_if_not(text.begin(), text.end(), is_key_character);
  return end != text.begin() && end != text.end() && *end == '=';
}

// The last '?' that is followed by "key=", or npos: a glob may contain question marks of its own.
std::size_t find_query(std::string_view text) {
  for (std::size_t at = text.rfind('?'); at != std::string_view::npos;
       at = text.rfind('?', at - 1)) {
    if (begins_with_key(text.substr(at + 1))) return at;
    if (at == 0) break;
  }
  return std::string_view::npos;
}

[[noreturn]] void refuse(const std::string& uri, const std::string& key, const std::string& value,
                         const std::string& expected) {
  throw Error(ErrorKind::kUsage, fmt::format("{}: {}={} - expected {}", uri, key, value, expected));
}

template <typename Number>
bool parse_whole(const std::string& text, Number& number) {
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  return error == std::errc() && end == last;
}

std::string named(const char* what, std::string_view text) {
  return fmt::format("{} '{}'", what, text);
}

}  // namespace

Uri::Uri(const char* what, std::string_view text) : what_(what), text_(text) {
  const std::size_t query = find_query(text);
  std::string_view rest =
      query == std::string_view::npos ? std::string_view() : text.substr(query + 1);
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(pair.size() + 1, rest.size()));
    const std::size_t equals = pair.find('=');
    if (equals == std::string_view::npos || equals == 0) {
      throw Error(ErrorKind::kUsage,
                  fmt::format("{}: '{}' is not key=value", named(what_, text), pair));
    }
    const auto [_, is_new] = parameters_.emplace(pair.substr(0, equals), pair.substr(equals + 1));
    if (!is_new) {
      throw Error(ErrorKind::kUsage,
                  fmt::format("{}: {} is given twice", named(what_, text), pair.substr(0, equals)));
    }
  }
}

std::string_view Uri::address() const noexcept {
  return std::string_view(text_).substr(0, find_query(text_));
}

std::string_view Uri::scheme_word(std::string_view address) noexcept {
  const std::size_t colon = address.find(':');
  const std::string_view word = address.substr(0, colon == std::string_view::npos ? 0 : colon);
  const bool is_word =
      std::all_of(word.begin(), word.end(), [](unsigned char c) { return std::isalnum(c) != 0; });
  return is_word ? word : std::string_view();
}

std::optional<std::string> Uri::take(const std::string& key) {
  used_.insert(key);
  const auto found = parameters_.find(key);
  if (found == parameters_.end()) return std::nullopt;
  return found->second;
}

std::optional<double> Uri::take_number(const std::string& key, double low, double high) {
  const std::optional<std::string> value = take(key);
  if (!value) return std::nullopt;
  double number = 0.0;
  if (!parse_whole(*value, number) || !std::isfinite(number) || number < low || number > high) {
    refuse(named(what_, text_), key, *value, fmt::format("a number from {} to {}", low, high));
  }
  return number;
}

std::optional<long> Uri::take_integer(const std::string& key, long low, long high) {
  const std::optional<std::string> value = take(key);
  if (!value) return std::nullopt;
  long number = 0;
  if (!parse_whole(*value, number) || number < low || number > high) {
    refuse(named(what_, text_), key, *value,
           fmt::format("a whole number from {} to {}", low, high));
  }
  return number;
}

std::optional<bool> Uri::take_bool(const std::string& key) {
  const std::optional<std::string> value = take(key);
  if (!value) return std::nullopt;
  for (const char* word : {"1", "true", "yes", "on"}) {
    if (*value == word) return true;
  }
  for (const char* word : {"0", "false", "no", "off"}) {
    if (*value == word) return false;
  }
  refuse(named(what_, text_), key, *value, "yes or no");
}

bool Uri::says_yes(const std::string& key) const {
  return Uri(*this).take_bool(key).value_or(false);
}

void Uri::set_default(const std::string& key, const std::string& value) {
  parameters_.emplace(key, value);
}

void Uri::refuse_unused(std::string_view known) const {
  for (const auto& [key, value] : parameters_) {
    if (used_.count(key) == 0) {
      throw Error(ErrorKind::kUsage, fmt::format("{}: unknown key '{}'; {}: knows {}",
                                                 named(what_, text_), key, scheme_, known));
    }
  }
}

std::map<std::string, std::string> Uri::take_rest() {
  std::map<std::string, std::string> rest;
  for (const auto& [key, value] : parameters_) {
    if (used_.insert(key).second) rest.emplace(key, value);
  }
  return rest;
}

std::optional<IlluminationPattern> take_pattern(Uri& uri) {
  const std::optional<std::string> word = uri.take("laser");
  if (!word) return std::nullopt;
  try {
    return IlluminationPattern::parse(*word);
  } catch (const Error& error) {
    throw Error(error.kind(), fmt::format("source '{}': {}", uri.text(), error.what()));
  }
}

}  // namespace striper
