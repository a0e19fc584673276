// SPDX-License-Identifier: Apache-2.0
#include "options/option_bounds.hpp"

#include <charconv>
#include <cmath>
#include <string>
#include <system_error>

#include <fmt/format.h>

namespace striper::program {
namespace {

// NaN where it is no number.
double number_of(const std::string& word) {
  double number = 0.0;
  const char* const last = word.data() + word.size();
  const auto [end, error] = std::from_chars(word.data(), last, number);
  return error == std::errc() && end == last ? number : std::nan("");
}

}  // namespace

WordCheck between(double low, double high) {
  return [=](const std::string& word) -> std::string {
    const double number = number_of(word);
    if (number >= low && number <= high) return {};
    return fmt::format("'{}' is no number from {:g} to {:g}", word, low, high);
  };
}

WordCheck at_least(double low) {
  return [=](const std::string& word) -> std::string {
    const double number = number_of(word);
    if (number >= low && std::isfinite(number)) return {};
    return fmt::format("'{}' is no number of {:g} or more", word, low);
  };
}

WordCheck not_zero() {
  return [](const std::string& word) -> std::string {
    const double number = number_of(word);
    if (number != 0.0 && std::isfinite(number)) return {};
    return fmt::format("'{}' is 0, or no finite number", word);
  };
}

}  // namespace striper::program
