// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include <striper/stream/scan_source.hpp>

namespace striper {

/// Reads scans back from a CSV (CONVENTIONS.md), the same bits: a scan is a run of lines of one
/// frame, laser and time. `frame`, `time_s`, `bearing_rad` and `range_m` have to be there, for
/// tables made elsewhere; x and y follow from them where they are not. The axis is told by which
/// pixel coordinate is whole.
/// @param model what the ranges were computed with, for the scans' frames; may be null.
/// @throws Error{kNotFound, kBadFile, kIo} naming file, line, column and what was expected.
std::unique_ptr<ScanSource> read_csv_scans(const std::filesystem::path& path,
                                           std::shared_ptr<const StriperModel> model = nullptr);

/// Reads scans back from JSON lines, the same bits; events are passed over.
std::unique_ptr<ScanSource> read_jsonl_scans(const std::filesystem::path& path,
                                             std::shared_ptr<const StriperModel> model = nullptr);

}  // namespace striper
