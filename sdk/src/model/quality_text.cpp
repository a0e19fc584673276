// SPDX-License-Identifier: Apache-2.0
#include "model/quality_text.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

namespace striper::detail {
namespace {

constexpr std::string_view kBlank = " \t\r";

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.push_back(text.substr(begin, end - begin));
    if (lines.back().ends_with('\r')) lines.back().pop_back();
    begin = end + 1;
  }
  return lines;
}

bool is_blank(const std::string& line) {
  return line.find_first_not_of(kBlank) == std::string::npos;
}

// The lines that belong to the key on line `first`: up to the next one that is not indented.
std::vector<std::string> cut_out(const std::vector<std::string>& lines, std::size_t first) {
  constexpr std::string_view kKey = "quality:";
  std::vector<std::string> block;
  if (first >= lines.size() || !lines[first].starts_with(kKey)) return block;
  const std::string rest = lines[first].substr(kKey.size());
  if (!is_blank(rest)) block.push_back(rest);
  for (std::size_t i = first + 1; i < lines.size(); ++i) {
    if (!is_blank(lines[i]) && lines[i].front() != ' ') break;
    block.push_back(lines[i]);
  }
  while (!block.empty() && is_blank(block.back())) block.pop_back();
  return block;
}

std::string without_indentation(const std::vector<std::string>& block) {
  std::size_t indentation = std::string::npos;
  for (const std::string& line : block) {
    if (!is_blank(line)) indentation = std::min(indentation, line.find_first_not_of(' '));
  }
  std::string text;
  for (const std::string& line : block) {
    text += is_blank(line) ? "" : line.substr(indentation);
    text += '\n';
  }
  return text;
}

bool says_the_same(const std::string& text, const YAML::Node& value) {
  try {
    return YAML::Dump(YAML::Load(text)) == YAML::Dump(value);
  } catch (const YAML::Exception&) {
    return false;
  }
}

}  // namespace

std::string quality_text(const std::string& yaml, const YAML::Node& root) {
  for (const auto& entry : root) {
    if (entry.first.Scalar() != "quality") continue;
    const int line = entry.first.Mark().line;
    std::string text = without_indentation(cut_out(lines_of(yaml), static_cast<std::size_t>(line)));
    return says_the_same(text, entry.second) ? text : YAML::Dump(entry.second) + "\n";
  }
  return {};
}

}  // namespace striper::detail
