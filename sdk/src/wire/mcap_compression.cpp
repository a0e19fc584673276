// SPDX-License-Identifier: Apache-2.0
#include "wire/mcap_compression.hpp"

#include <fmt/format.h>

#include <striper/core/error.hpp>

#ifdef STRIPER_WITH_ZSTD
#include <zstd.h>
#endif
#ifdef STRIPER_WITH_LZ4
#include <lz4frame.h>
#endif

namespace striper::wire {

bool has_compression(McapCompression compression) noexcept {
  switch (compression) {
    case McapCompression::kNone:
#ifdef STRIPER_WITH_ZSTD
    case McapCompression::kZstd:
#endif
#ifdef STRIPER_WITH_LZ4
    case McapCompression::kLz4:
#endif
      return true;
    default:
      return false;
  }
}

std::string_view to_string(McapCompression compression) noexcept {
  switch (compression) {
    case McapCompression::kZstd:
      return "zstd";
    case McapCompression::kLz4:
      return "lz4";
    default:
      return "";
  }
}

std::optional<McapCompression> compression_from_string(std::string_view word) noexcept {
  for (const auto compression :
       {McapCompression::kNone, McapCompression::kZstd, McapCompression::kLz4}) {
    if (word == to_string(compression)) return compression;
  }
  return std::nullopt;
}

void require_compression(McapCompression compression, std::string_view path) {
  if (has_compression(compression)) return;
  throw Error(
      ErrorKind::kUnsupported,
      fmt::format("{}: this build of Striper has no {}: install lib{}-dev and build it again", path,
                  to_string(compression), to_string(compression)));
}

#ifdef STRIPER_WITH_ZSTD
struct Packer::Context {
  std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> zstd{ZSTD_createCCtx(), &ZSTD_freeCCtx};
  int level;
};

bool Packer::pack(ByteSpan bytes, Bytes& out) {
  const std::size_t start = out.size();
  out.resize(start + ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compressCCtx(context_->zstd.get(), out.data() + start, out.size() - start, bytes.data(),
                        bytes.size(), context_->level);
  const bool is_smaller = ZSTD_isError(size) == 0 && size < bytes.size();
  out.resize(start + (is_smaller ? size : 0));
  return is_smaller;
}

static std::string unpack_zstd(ZSTD_DCtx* context, ByteSpan packed, std::span<std::uint8_t> out) {
  const std::size_t size =
      ZSTD_decompressDCtx(context, out.data(), out.size(), packed.data(), packed.size());
  if (ZSTD_isError(size) != 0) return fmt::format("zstd: {}", ZSTD_getErrorName(size));
  return size == out.size() ? "" : fmt::format("{} bytes unpacked, {} expected", size, out.size());
}
#else
struct Packer::Context {
  int level;
};
bool Packer::pack(ByteSpan, Bytes&) { return false; }
#endif

Packer::Packer(int level) : context_(std::make_unique<Context>()) { context_->level = level; }
Packer::~Packer() = default;

#ifdef STRIPER_WITH_LZ4
namespace {

std::string unpack_lz4(LZ4F_dctx* context, ByteSpan packed, std::span<std::uint8_t> out) {
  LZ4F_resetDecompressionContext(context);
  std::size_t written = 0;
  std::size_t hint = 1;  // 0 where a frame ends.
  while (!packed.empty()) {
    std::size_t room = out.size() - written;
    std::size_t taken = packed.size();
    hint = LZ4F_decompress(context, out.data() + written, &room, packed.data(), &taken, nullptr);
    if (LZ4F_isError(hint) != 0) return fmt::format("lz4: {}", LZ4F_getErrorName(hint));
    if (room == 0 && taken == 0) return "lz4: more bytes than the chunk says";
    written += room;
    packed = packed.subspan(taken);
  }
  if (hint != 0) return "lz4: the frame does not end";
  return written == out.size() ? ""
                               : fmt::format("{} bytes unpacked, {} expected", written, out.size());
}

}  // namespace
#endif

struct Unpacker::Context {
#ifdef STRIPER_WITH_ZSTD
  std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> zstd{nullptr, &ZSTD_freeDCtx};
#endif
#ifdef STRIPER_WITH_LZ4
  LZ4F_dctx* lz4 = nullptr;
  Context() = default;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  ~Context() { LZ4F_freeDecompressionContext(lz4); }
#endif
};

Unpacker::Unpacker() : context_(std::make_unique<Context>()) {}
Unpacker::~Unpacker() = default;

std::string Unpacker::unpack(McapCompression compression, [[maybe_unused]] ByteSpan packed,
                             [[maybe_unused]] std::span<std::uint8_t> out) {
  switch (compression) {
#ifdef STRIPER_WITH_ZSTD
    case McapCompression::kZstd:
      if (!context_->zstd) context_->zstd.reset(ZSTD_createDCtx());
      return unpack_zstd(context_->zstd.get(), packed, out);
#endif
#ifdef STRIPER_WITH_LZ4
    case McapCompression::kLz4:
      if (context_->lz4 == nullptr) LZ4F_createDecompressionContext(&context_->lz4, LZ4F_VERSION);
      return unpack_lz4(context_->lz4, packed, out);
#endif
    default:
      return "cannot be unpacked";
  }
}

}  // namespace striper::wire
