// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace striper {

/// The messages of one topic; of a table, its scans.
struct TopicInfo {
  std::string name;
  std::string type;
  std::uint64_t count = 0;
  double first_s = 0.0;
  double last_s = 0.0;
  double largest_gap_s = 0.0;  ///< Between two that follow one another.

  /// Messages a second between the first and the last; 0 of less than two.
  double rate_hz() const noexcept;
  void add(double time_s) noexcept;
};

/// What of a file could not be read.
struct RecordingDamage {
  std::optional<std::uint64_t> offset;  ///< Byte; a table knows its line, in `reason`.
  std::optional<std::uint64_t> lost_bytes;
  std::string reason;
};

/// What is in a file of scans or frames.
struct RecordingInfo {
  std::string format;  ///< "csv", "jsonl" or "mcap".
  std::uint64_t bytes = 0;
  std::optional<double>
      start_s;  ///< Of the first message, on the file's clock; empty: there is none.
  double duration_s = 0.0;
  std::vector<std::string> heads;
  std::vector<TopicInfo> topics;
  std::uint64_t frames = 0;
  std::uint64_t scans = 0;
  std::set<int> lasers;                       ///< Of the scans.
  std::map<std::string, std::string> models;  ///< Per head, what is attached.
  std::vector<RecordingDamage> damages;

  /// Bytes that no reader gets, where that is known.
  std::optional<std::uint64_t> lost_bytes() const noexcept;
};

/// Reads a recording (.mcap) or a table of scans (.csv, .jsonl) from end to end, damaged or not.
///
/// Memory: a chunk, or a line. @param go_on asked after each message, or scan, with the bytes read
/// so far; false ends the inspection early, which then knows what it has seen. Thread-safe.
/// @throws Error: kUnsupported for another kind of file; kNotFound, kIo; kBadFile where nothing at
/// all can be read.
RecordingInfo inspect_recording(const std::filesystem::path& path,
                                const std::function<bool(std::uint64_t)>& go_on = {});

}  // namespace striper
