// SPDX-License-Identifier: Apache-2.0
#include "wire/mcap_bytes.hpp"

#include <array>

#include <fmt/format.h>
#include <zlib.h>

#include <striper/core/error.hpp>

namespace striper::wire {

std::string_view to_string(Opcode opcode) noexcept {
  static constexpr std::array<std::string_view, 16> kNames = {
      "unknown record",   "header",     "footer",        "schema",         "channel",
      "message",          "chunk",      "message index", "chunk index",    "attachment",
      "attachment index", "statistics", "metadata",      "metadata index", "summary offset",
      "data end"};
  const auto index = static_cast<std::size_t>(opcode);
  return index < kNames.size() ? kNames[index] : kNames[0];
}

void ByteWriter::put(std::string_view text) {
  put(static_cast<std::uint32_t>(text.size()));
  out_.insert(out_.end(), text.begin(), text.end());
}

void ByteWriter::put(const TextMap& map) {
  const std::size_t begun = out_.size();
  put(std::uint32_t{0});
  for (const auto& [key, value] : map) {
    put(std::string_view(key));
    put(std::string_view(value));
  }
  const std::uint64_t size = out_.size() - begun - 4;
  for (std::size_t i = 0; i < 4; ++i) out_[begun + i] = static_cast<std::uint8_t>(size >> (8 * i));
}

std::size_t ByteWriter::begin(Opcode opcode) {
  const std::size_t begun = out_.size();
  put(static_cast<std::uint8_t>(opcode));
  put(std::uint64_t{0});
  return begun;
}

void ByteWriter::end(std::size_t begun) {
  const std::uint64_t size = out_.size() - begun - kRecordHeaderBytes;
  for (std::size_t i = 0; i < 8; ++i)
    out_[begun + 1 + i] = static_cast<std::uint8_t>(size >> (8 * i));
}

void refuse(const RecordPlace& place, const std::string& why) {
  throw Error(ErrorKind::kBadFile,
              fmt::format("{}: the {} at byte {}: {}", place.path, place.what, place.offset, why));
}

ByteSpan ByteReader::take_bytes(std::uint64_t count) {
  if (count > left()) refuse(place_, fmt::format("{} bytes expected, {} are left", count, left()));
  const ByteSpan taken = bytes_.subspan(at_, count);
  at_ += count;
  return taken;
}

std::string ByteReader::take_text() {
  const ByteSpan bytes = take_bytes(take<std::uint32_t>());
  return {bytes.begin(), bytes.end()};
}

TextMap ByteReader::take_map() {
  ByteReader entries(take_bytes(take<std::uint32_t>()), place_);
  TextMap map;
  while (entries.left() > 0) {
    std::string key = entries.take_text();
    map[std::move(key)] = entries.take_text();
  }
  return map;
}

std::uint32_t crc32_of(ByteSpan bytes, std::uint32_t before) noexcept {
  return static_cast<std::uint32_t>(::crc32_z(before, bytes.data(), bytes.size()));
}

}  // namespace striper::wire
