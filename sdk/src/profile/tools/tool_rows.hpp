// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>

#include <striper/profile/tools.hpp>

namespace striper::detail {

inline constexpr std::size_t kMostRows = 3;

/// A row of a tool: what stands behind the tool's name, and its unit.
struct ToolRow {
  std::string_view name;
  std::string_view unit;
};

/// What the program calls a tool, and the rows that it gives.
struct ToolWords {
  ToolKind kind;
  std::string_view word;
  int most_regions;
  std::array<ToolRow, kMostRows> rows;

  std::size_t row_count() const noexcept {
    std::size_t count = 0;
    while (count < kMostRows && !rows[count].name.empty()) ++count;
    return count;
  }
};

/// In the order of ToolKind.
inline constexpr std::array<ToolWords, 9> kToolWords{{
    {ToolKind::kLine,
     "line",
     1,
     {{{"line.distance", "m"}, {"line.angle", "rad"}, {"line.straightness", "m"}}}},
    {ToolKind::kStep, "step", 2, {{{"step", "m"}, {}, {}}}},
    {ToolKind::kGap, "gap", 2, {{{"gap", "m"}, {}, {}}}},
    {ToolKind::kFlush, "flush", 2, {{{"flush", "m"}, {}, {}}}},
    {ToolKind::kWidth, "width", 1, {{{"width", "m"}, {}, {}}}},
    {ToolKind::kAngle, "angle", 2, {{{"angle", "rad"}, {}, {}}}},
    {ToolKind::kCircle,
     "circle",
     1,
     {{{"circle.radius", "m"}, {"circle.x", "m"}, {"circle.y", "m"}}}},
    {ToolKind::kPosition, "position", 2, {{{"position.x", "m"}, {"position.y", "m"}, {}}}},
    {ToolKind::kArea, "area", 2, {{{"area", "m2"}, {}, {}}}},
}};

/// Null for a word that is no tool.
const ToolWords* tool_words(std::string_view word) noexcept;
const ToolWords& tool_words(ToolKind kind) noexcept;
std::string all_tool_words();

/// How many straight pieces a tool measures.
inline std::size_t patches_of(ToolKind kind) noexcept {
  const bool is_one =
      kind == ToolKind::kLine || kind == ToolKind::kCircle || kind == ToolKind::kWidth;
  return is_one ? 1 : 2;
}

/// @throws Error{kUsage} where a tool has more regions than it can use.
void require_regions(const MeasureTool& tool);

}  // namespace striper::detail
