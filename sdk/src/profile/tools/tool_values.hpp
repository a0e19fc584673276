// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "profile/tools/patch.hpp"
#include "profile/tools/tool_rows.hpp"

namespace striper::detail {

/// One figure of a tool. Without its calibration's error.
struct ToolValue {
  double value = Measurement::kNone;
  double variance = Measurement::kNone;
  MeasureStatus status = MeasureStatus::kOk;
};

using ToolValues = std::array<ToolValue, kMostRows>;

/// Returns what a tool says of patches, in the order of its rows.
/// @param ranges  the scan's as they are, or moved.
ToolValues values_of(const MeasureTool& tool, const InverseRanges& ranges, const Patches& pieces,
                     const std::vector<Patch>& patches);

/// The returns that this is made from.
int points_of(ToolKind kind, const std::vector<Patch>& patches) noexcept;

}  // namespace striper::detail
