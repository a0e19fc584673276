// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include <striper/wire/mcap_writer.hpp>

namespace striper::wire {

/// When a recording goes on in a new file; 0: never for that reason.
struct McapRotation {
  std::uint64_t bytes = 0;
  std::uint64_t ns = 0;  ///< Of log time.

  bool is_wanted() const noexcept { return bytes > 0 || ns > 0; }
  /// run.mcap, or of its series run_0000.mcap, run_0001.mcap, ...
  std::filesystem::path file(const std::filesystem::path& path, std::size_t index) const;
  /// "1GB", "500MB", "10min", "90s", "2h" (decimal units). @throws Error{kUsage} for anything else.
  static McapRotation parse(std::string_view text);
};

/// One recording in one file, or with rotation in several: run.mcap gives run_0000.mcap,
/// run_0001.mcap, ... Each stands alone: channels, attachments and metadata are in all of them. Not
/// thread-safe.
class McapSeries {
 public:
  McapSeries(std::filesystem::path path, McapRotation rotation,
             const McapWriterOptions& options = {});

  // As McapWriter.
  std::uint16_t add_channel(const McapChannel& channel);
  void write(const McapMessage& message);
  void attach(const McapAttachment& attachment);
  void add_metadata(const McapMetadata& metadata);
  void flush();
  void close();

  const std::vector<std::filesystem::path>& paths() const noexcept { return paths_; }

 private:
  void open_next();
  bool is_full(const McapMessage& message) const noexcept;

  std::filesystem::path path_;
  McapRotation rotation_;
  McapWriterOptions options_;
  std::vector<std::filesystem::path> paths_;
  std::unique_ptr<McapWriter> writer_;
  std::vector<McapChannel> channels_;
  std::vector<McapAttachment> attachments_;
  std::vector<McapMetadata> metadata_;
};

}  // namespace striper::wire
