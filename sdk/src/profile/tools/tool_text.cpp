// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <charconv>
#include <optional>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/profile/tools.hpp>

#include "profile/tools/tool_rows.hpp"

namespace striper {
namespace {

constexpr const char* kForm = "expected NAME:TOOL[:REGION[;REGION]]";

[[noreturn]] void refuse(std::string_view text, const std::string& why) {
  throw Error(ErrorKind::kUsage, fmt::format("tool '{}': {}", text, why));
}

// What stands before `separator`; the rest stays in `text`.
std::string_view take_until(std::string_view& text, std::string_view separator) {
  const std::size_t at = text.find(separator);
  const std::string_view head = text.substr(0, at);
  text = at == std::string_view::npos ? std::string_view{} : text.substr(at + separator.size());
  return head;
}

std::optional<double> number_of(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// `x=A..B`
void read_bounds(std::string_view whole, std::string_view text, MeasureRegion& region) {
  const std::string_view axis = take_until(text, "=");
  const bool is_x = axis == "x";
  const std::size_t dots = text.find("..");
  if ((!is_x && axis != "y") || dots == std::string_view::npos)
    refuse(whole, "a region is x=A..B,y=C..D, in metres");
  const std::string_view from = text.substr(0, dots);
  const std::string_view to = text.substr(dots + 2);
  double& low = is_x ? region.x_from_m : region.y_from_m;
  double& high = is_x ? region.x_to_m : region.y_to_m;
  if (!from.empty()) low = number_of(from).value_or(Measurement::kNone);
  if (!to.empty()) high = number_of(to).value_or(Measurement::kNone);
  if (!(low < high))
    refuse(whole, fmt::format("{}={} is no interval: expected two numbers, the smaller one first",
                              axis, text));
}

MeasureRegion read_region(std::string_view whole, std::string_view text) {
  MeasureRegion region;
  while (!text.empty()) read_bounds(whole, take_until(text, ","), region);
  return region;
}

}  // namespace

MeasureTool parse_measure_tool(std::string_view text) {
  std::string_view rest = text;
  MeasureTool tool;
  tool.name = take_until(rest, ":");
  if (tool.name.empty() || tool.name.find_first_of("=,;. ") != std::string::npos)
    refuse(text, fmt::format("{}, NAME without = , ; . and blanks", kForm));
  const std::string_view word = take_until(rest, ":");
  const detail::ToolWords* const words = detail::tool_words(word);
  if (words == nullptr)
    refuse(text, fmt::format("{}, TOOL one of {}", kForm, detail::all_tool_words()));
  tool.kind = words->kind;
  while (!rest.empty()) tool.regions.push_back(read_region(text, take_until(rest, ";")));
  detail::require_regions(tool);
  return tool;
}

namespace detail {

const ToolWords* tool_words(std::string_view word) noexcept {
  for (const ToolWords& words : kToolWords)
    if (words.word == word) return &words;
  return nullptr;
}

const ToolWords& tool_words(ToolKind kind) noexcept {
  return kToolWords[static_cast<std::size_t>(kind)];
}

std::string all_tool_words() {
  std::string all;
  for (const ToolWords& words : kToolWords) {
    if (!all.empty()) all += ", ";
    all += words.word;
  }
  return all;
}

void require_regions(const MeasureTool& tool) {
  const ToolWords& words = tool_words(tool.kind);
  if (static_cast<int>(tool.regions.size()) <= words.most_regions) return;
  throw Error(
      ErrorKind::kUsage,
      fmt::format("tool '{}': {} takes at most {} region{}, not {}", tool.name, words.word,
                  words.most_regions, words.most_regions == 1 ? "" : "s", tool.regions.size()));
}

}  // namespace detail
}  // namespace striper
