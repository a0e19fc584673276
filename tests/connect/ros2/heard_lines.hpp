// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

// How the subscribers of the tests say what they heard: a line of JSON a message, the same of every
// maker's DDS. JSON has no NaN and no infinity: null and "inf" stand for them.
namespace striper::testing {

inline nlohmann::json number(double value) {
  if (std::isnan(value)) return nullptr;
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  return value;
}

/// Of anything with begin and size: numbers.
template <typename T>
nlohmann::json numbers(const T* values, std::size_t count) {
  nlohmann::json list = nlohmann::json::array();
  for (std::size_t i = 0; i < count; ++i) list.push_back(number(static_cast<double>(values[i])));
  return list;
}

inline std::string hexadecimal(const std::uint8_t* bytes, std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += fmt::format("{:02x}", bytes[i]);
  return text;
}

/// Whole lines, at once: others read while this one writes.
inline void print_line(const nlohmann::json& line) {
  fmt::print("{}\n", line.dump());
  std::fflush(stdout);
}

}  // namespace striper::testing
