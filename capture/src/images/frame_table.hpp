// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <striper/core/csv_table.hpp>
#include <striper/core/event.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/illumination_pattern.hpp>

namespace striper::detail {

inline constexpr std::string_view kFrameTableName = "frames.csv";

/// One line of a recording's `frames.csv`: where a frame's image file is and everything else that
/// the frame says.
struct FrameRow {
  std::string file;             ///< Name in the same directory; empty for a frame without an image.
  Frame frame;                  ///< Without the image.
  IlluminationPattern pattern;  ///< Of the source that was recorded.
};

/// The table's columns (CONVENTIONS.md, Recordings).
std::span<const CsvColumn<FrameRow>> frame_columns();

/// Reads a table. Columns are found by name; `file` must be there, every other may be missing (then
/// it is as in a new Frame, with `sequence` counting up), unknown ones are ignored. A last line
/// that was cut off (no line end, fields missing) is left out and `recording_cut` is sent.
/// @param default_period_ns from frame to frame where the table has no times.
/// @throws Error as `CsvReader` does.
std::vector<FrameRow> read_frame_table(const std::filesystem::path& path,
                                       std::int64_t default_period_ns, const EventPort& events);

}  // namespace striper::detail
