// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

constexpr std::array<std::string_view, 5> kSchemes{"images", "sim", "v4l2", "gige", "u3v"};

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

std::string guess_scheme(std::string_view path) {
  if (path.ends_with(".yaml") || path.ends_with(".yml")) return "sim";
  if (path.starts_with("/dev/")) return "v4l2";
  return "images";
}

[[noreturn]] void refuse(std::string_view uri, const std::string& key, const std::string& value,
                         const std::string& expected) {
  throw Error(ErrorKind::kUsage,
              fmt::format("source '{}': {}={} - expected {}", uri, key, value, expected));
}

template <typename Number>
bool parse_whole(const std::string& text, Number& number) {
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  return error == std::errc() && end == last;
}

}  // namespace

SourceUri SourceUri::parse(std::string_view text) {
  if (text.empty())
    throw Error(ErrorKind::kUsage, "the source is empty: name a directory, file or device");
  SourceUri uri;
  uri.text_ = text;
  const std::size_t query = find_query(text);
  const std::string_view address = text.substr(0, query);

  const std::size_t colon = address.find(':');
  const std::string_view prefix = address.substr(0, colon == std::string_view::npos ? 0 : colon);
  const bool looks_like_scheme =
      !prefix.empty() && std::all_of(prefix.begin(), prefix.end(),
                                     [](unsigned char c) { return std::isalnum(c) != 0; });
  if (std::find(kSchemes.begin(), kSchemes.end(), prefix) != kSchemes.end()) {
    uri.scheme_ = prefix;
    uri.path_ = address.substr(colon + 1);
  } else if (looks_like_scheme) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("source '{}': unknown kind '{}'; there are {} (a path that contains a colon is "
                    "written images:PATH)",
                    text, prefix, fmt::join(kSchemes, ", ")));
  } else {
    uri.scheme_ = guess_scheme(address);
    uri.path_ = address;
  }

  std::string_view rest =
      query == std::string_view::npos ? std::string_view() : text.substr(query + 1);
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(pair.size() + 1, rest.size()));
    const std::size_t equals = pair.find('=');
    if (equals == std::string_view::npos || equals == 0) {
      throw Error(ErrorKind::kUsage, fmt::format("source '{}': '{}' is not key=value", text, pair));
    }
    const auto [_, is_new] =
        uri.parameters_.emplace(pair.substr(0, equals), pair.substr(equals + 1));
    if (!is_new) {
      throw Error(ErrorKind::kUsage,
                  fmt::format("source '{}': {} is given twice", text, pair.substr(0, equals)));
    }
  }
  return uri;
}

std::optional<std::string> SourceUri::take(const std::string& key) {
  used_.insert(key);
  const auto found = parameters_.find(key);
  if (found == parameters_.end()) return std::nullopt;
  return found->second;
}

std::optional<double> SourceUri::take_number(const std::string& key, double low, double high) {
  const std::optional<std::string> value = take(key);
  if (!value) return std::nullopt;
  double number = 0.0;
  if (!parse_whole(*value, number) || !std::isfinite(number) || number < low || number > high) {
    refuse(text_, key, *value, fmt::format("a number from {} to {}", low, high));
  }
  return number;
}

std::optional<long> SourceUri::take_integer(const std::string& key, long low, long high) {
  const std::optional<std::string> value = take(key);
  if (!value) return std::nullopt;
  long number = 0;
  if (!parse_whole(*value, number) || number < low || number > high) {
    refuse(text_, key, *value, fmt::format("a whole number from {} to {}", low, high));
  }
  return number;
}

std::optional<bool> SourceUri::take_bool(const std::string& key) {
  const std::optional<std::string> value = take(key);
  if (!value) return std::nullopt;
  for (const char* word : {"1", "true", "yes", "on"}) {
    if (*value == word) return true;
  }
  for (const char* word : {"0", "false", "no", "off"}) {
    if (*value == word) return false;
  }
  refuse(text_, key, *value, "yes or no");
}

void SourceUri::refuse_unused(std::string_view known) const {
  for (const auto& [key, value] : parameters_) {
    if (used_.count(key) == 0) {
      throw Error(ErrorKind::kUsage, fmt::format("source '{}': unknown key '{}'; {}: knows {}",
                                                 text_, key, scheme_, known));
    }
  }
}

std::map<std::string, std::string> SourceUri::take_rest() {
  std::map<std::string, std::string> rest;
  for (const auto& [key, value] : parameters_) {
    if (used_.insert(key).second) rest.emplace(key, value);
  }
  return rest;
}

}  // namespace striper
