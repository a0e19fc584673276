// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include <striper/stream/scan_source.hpp>

namespace striper {

/// Reads scans back from a CSV, ours or another's, as a ScanCsvReader does.
/// @param model what the ranges were computed with, for the scans' frames; may be null.
/// @throws Error{kNotFound, kBadFile, kIo} naming file, line, column and what was expected.
std::unique_ptr<ScanSource> read_csv_scans(const std::filesystem::path& path,
                                           std::shared_ptr<const StriperModel> model = nullptr);

/// Reads scans back from JSON lines, the same bits; events are passed over. A last line that was
/// cut off (a writer that was killed) is left out.
std::unique_ptr<ScanSource> read_jsonl_scans(const std::filesystem::path& path,
                                             std::shared_ptr<const StriperModel> model = nullptr);

/// Reads scans back from an MCAP recording, the same bits, up to the last whole chunk where its
/// writer was killed.
/// @param model null: the one attached to the file for each head, if any. @param head empty: all.
/// @param skip_damaged leaves out what is damaged (`inspect_recording` says what), instead of
/// refusing it.
/// @throws Error{kNotFound} where no scans are in it, and as wire::McapReader.
std::unique_ptr<ScanSource> read_mcap_scans(const std::filesystem::path& path,
                                            std::shared_ptr<const StriperModel> model = nullptr,
                                            std::string head = {}, bool skip_damaged = false);

/// The model that a recording has attached for a head; of several the last. Null where there is
/// none. @param head empty: the one whose model was attached first. @throws as wire::McapReader,
/// parse_model.
std::shared_ptr<const StriperModel> attached_model(const std::filesystem::path& path,
                                                   std::string_view head = {});

}  // namespace striper
