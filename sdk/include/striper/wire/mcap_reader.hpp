// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <striper/wire/mcap_records.hpp>

namespace striper::wire {

struct McapReaderOptions {
  std::size_t max_chunk_bytes = std::size_t{256}
                                << 20;  ///< Of a chunk, an attachment and the summary.
  bool skip_damaged =
      false;  ///< Leave out what is damaged and count it, instead of refusing the file.
};

/// How a file ends.
enum class McapEnd {
  kUnread,  ///< Not all messages were read yet.
  kWhole,
  kCut,  ///< In the middle: its writer died, or it was copied in part.
};

/// Bytes of a file that could not be read, and why.
struct McapDamage {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::string reason;
};

/// Reads MCAP files of anybody, in the order in which they were written: with and without chunks,
/// indexes and summary; uncompressed, zstd and lz4; cut files up to the last whole chunk. All
/// checksums are verified. Not thread-safe.
///
/// Memory: a chunk twice, at most `max_chunk_bytes` each; lengths in the file are believed no
/// further.
class McapReader {
 public:
  /// Opens the file and reads its summary, or finds attachments and metadata by a walk over its
  /// records.
  /// @throws Error naming the file and the byte: kNotFound; kIo; kBadFile where it is no MCAP file
  /// or damaged;
  ///         kUnsupported for what this build cannot decompress.
  explicit McapReader(const std::filesystem::path& path, const McapReaderOptions& options = {});
  McapReader(const McapReader&) = delete;
  McapReader& operator=(const McapReader&) = delete;
  ~McapReader();

  const std::string& profile() const noexcept;
  const std::string& library() const noexcept;

  /// Those of the summary, and those met since. Numbers are the file's own.
  const std::map<std::uint16_t, McapChannel>& channels() const noexcept;
  const std::optional<McapStatistics>& statistics() const noexcept;
  const std::vector<McapMetadata>& metadata() const noexcept;

  /// Without `data`: see `read_attachment`.
  const std::vector<McapAttachment>& attachments() const noexcept;
  McapAttachment read_attachment(std::size_t index);

  /// The next message; false where there are no more. `message.data` is valid until the next call.
  /// @throws Error as the constructor; what was read before is good.
  bool next(McapMessage& message);

  McapEnd end() const noexcept;
  /// The file was cut before its first message, and nobody knows what was in it.
  bool is_cut_at_beginning() const noexcept { return end() == McapEnd::kCut && channels().empty(); }
  /// Where the last whole record of the data that were read ends.
  std::uint64_t whole_bytes() const noexcept;
  /// What was left out so far with `skip_damaged`, most of all chunks. Where the file was cut, and
  /// all is read: what is behind the last whole record, perhaps of 0 bytes.
  const std::vector<McapDamage>& damages() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper::wire
