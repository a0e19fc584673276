// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace striper::wire {

using Bytes = std::vector<std::uint8_t>;
using ByteSpan = std::span<const std::uint8_t>;

/// https://mcap.dev/spec, "Records".
enum class Opcode : std::uint8_t {
  kHeader = 1,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kAttachment,
  kAttachmentIndex,
  kStatistics,
  kMetadata,
  kMetadataIndex,
  kSummaryOffset,
  kDataEnd,
};

/// "chunk", "attachment", ... for messages.
std::string_view to_string(Opcode opcode) noexcept;

inline constexpr std::string_view kMcapMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::size_t kRecordHeaderBytes = 9;  ///< Opcode, length.
inline constexpr std::size_t kFooterBytes = 20;

using TextMap = std::map<std::string, std::string>;

/// Appends values, little endian.
class ByteWriter {
 public:
  explicit ByteWriter(Bytes& out) : out_(out) {}

  template <std::unsigned_integral T>
  void put(T value) {
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      out_.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i)));
    }
  }
  void put(ByteSpan bytes) { out_.insert(out_.end(), bytes.begin(), bytes.end()); }
  /// The length, then the bytes.
  void put(std::string_view text);
  void put(const TextMap& map);

  /// Opens a record; `end` fills in its length.
  std::size_t begin(Opcode opcode);
  void end(std::size_t begun);

 private:
  Bytes& out_;
};

/// What and where a reader is, for its messages.
struct RecordPlace {
  std::string_view path;
  std::string_view what;  ///< "chunk".
  std::uint64_t offset;   ///< Of the record in the file.
};

/// @throws Error{kBadFile}: "run.mcap: the chunk at byte 123: ...".
[[noreturn]] void refuse(const RecordPlace& place, const std::string& why);

/// Takes values from a record. @throws Error{kBadFile} where there are too few bytes.
class ByteReader {
 public:
  ByteReader(ByteSpan bytes, const RecordPlace& place) : bytes_(bytes), place_(place) {}

  template <std::unsigned_integral T>
  T take() {
    const ByteSpan bytes = take_bytes(sizeof(T));
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i)
      value |= static_cast<std::uint64_t>(bytes[i]) << (8 * i);
    return static_cast<T>(value);
  }
  ByteSpan take_bytes(std::uint64_t count);
  std::string take_text();
  TextMap take_map();
  ByteSpan rest() { return take_bytes(left()); }
  std::size_t left() const noexcept { return bytes_.size() - at_; }
  std::size_t at() const noexcept { return at_; }

 private:
  ByteSpan bytes_;
  RecordPlace place_;
  std::size_t at_ = 0;
};

/// The CRC-32 of zlib; `before`: that of the bytes before these.
std::uint32_t crc32_of(ByteSpan bytes, std::uint32_t before = 0) noexcept;

}  // namespace striper::wire
