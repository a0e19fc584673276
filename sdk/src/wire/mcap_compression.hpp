// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <striper/wire/mcap_records.hpp>

#include "wire/mcap_bytes.hpp"

namespace striper::wire {

/// MCAP's word for it: "", "zstd" or "lz4".
std::string_view to_string(McapCompression compression) noexcept;
std::optional<McapCompression> compression_from_string(std::string_view word) noexcept;

/// @throws Error{kUnsupported} naming the library that this build lacks.
void require_compression(McapCompression compression, std::string_view path);

/// Packs chunks with zstd; keeps its memory from chunk to chunk.
class Packer {
 public:
  explicit Packer(int level);
  ~Packer();
  /// Appends the packed bytes to `out`. False, and `out` as it was, where they are no fewer.
  bool pack(ByteSpan bytes, Bytes& out);

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

/// Unpacks chunks of zstd and of lz4 frames.
class Unpacker {
 public:
  Unpacker();
  ~Unpacker();
  /// @param out its size is that of the bytes unpacked; all must come, and no more.
  /// @returns what is wrong; empty: nothing.
  std::string unpack(McapCompression compression, ByteSpan packed, std::span<std::uint8_t> out);

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

}  // namespace striper::wire
