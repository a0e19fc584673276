// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include <striper/wire/mcap_records.hpp>

namespace striper::wire {

struct McapWriterOptions {
  /// kZstd or kNone; a chunk that zstd does not make smaller is stored as it is.
  McapCompression compression =
      has_compression(McapCompression::kZstd) ? McapCompression::kZstd : McapCompression::kNone;
  int zstd_level = 1;
  std::size_t chunk_bytes = 1 << 20;     ///< A chunk is closed before it grows beyond;
  std::uint64_t chunk_ns = 500'000'000;  ///< or before its messages' log times span more.
  std::string profile = "ros2";
};

/// Writes an MCAP file: chunks with their indexes and checksums, attachments, metadata, and at the
/// end a summary with statistics, as rosbag2 and Foxglove's tools want it.
///
/// Only whole chunks reach the disk: a file whose writer died is readable up to its last chunk, so
/// that at most `chunk_ns` of recording are lost. Where the disk is full the file is cut back to
/// the last whole record. No allocation per message once every channel has had a chunk. Not
/// thread-safe.
class McapWriter {
 public:
  /// Makes the file, replacing another. @throws Error{kIo}, or {kUnsupported} for a compression
  /// that this build lacks.
  explicit McapWriter(const std::filesystem::path& path, const McapWriterOptions& options = {});
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;
  ~McapWriter();  ///< Closes without reporting; call `close` to hear of errors.

  /// The number that messages of the channel carry, from 0. Equal schemas are written once.
  std::uint16_t add_channel(const McapChannel& channel);

  /// Appends to the chunk. @throws Error{kIo} where the chunk before cannot be written, kBadValue
  /// for an unknown channel.
  void write(const McapMessage& message);

  /// Writes an attachment or metadata at once, in front of the messages that are still in the
  /// chunk.
  void attach(const McapAttachment& attachment);
  void add_metadata(const McapMetadata& metadata);

  /// Closes the chunk; what was written is then with the system.
  void flush();

  /// Flushes, writes summary and footer, closes. The file cannot be written any more. @throws
  /// Error{kIo}.
  void close();

  const McapStatistics& statistics() const noexcept;
  /// Of the file so far, the open chunk included uncompressed.
  std::uint64_t bytes() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper::wire
