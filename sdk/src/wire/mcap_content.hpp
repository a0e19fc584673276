// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <striper/wire/mcap_records.hpp>

#include "wire/mcap_bytes.hpp"

// Records as bytes and back, each in one place: https://mcap.dev/spec, "Records".
namespace striper::wire {

struct SchemaRecord {
  std::uint16_t id = 0;
  McapSchema schema;
};

struct ChannelRecord {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;  ///< 0: none.
  McapChannel channel;          ///< Without its schema.
};

struct ChunkHeader {
  std::uint64_t start_ns = 0;
  std::uint64_t end_ns = 0;
  std::uint64_t unpacked_bytes = 0;
  std::uint32_t unpacked_crc = 0;
  std::string compression;
};

struct AttachmentIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  McapAttachment about;  ///< Without data.
  std::uint64_t data_bytes = 0;
};

struct Footer {
  std::uint64_t summary_start = 0;
  std::uint64_t summary_offset_start = 0;
  std::uint32_t summary_crc = 0;
};

/// Appends whole records.
void put_header(ByteWriter out, std::string_view profile, std::string_view library);
void put_schema(ByteWriter out, std::uint16_t id, const McapSchema& schema);
void put_channel(ByteWriter out, std::uint16_t id, std::uint16_t schema_id,
                 const McapChannel& channel);
void put_message(ByteWriter out, const McapMessage& message);
void put_metadata(ByteWriter out, const McapMetadata& metadata);
void put_attachment(Bytes& out, const McapAttachment& attachment);
void put_statistics(ByteWriter out, const McapStatistics& statistics);
void put_attachment_index(ByteWriter out, const AttachmentIndex& index);

/// Takes a record's content.
SchemaRecord take_schema(ByteReader in);
ChannelRecord take_channel(ByteReader in);
McapMessage take_message(ByteReader in);
McapMetadata take_metadata(ByteReader in);
McapAttachment take_attachment(ByteReader in, ByteSpan content, const RecordPlace& place);
McapStatistics take_statistics(ByteReader in);
AttachmentIndex take_attachment_index(ByteReader in);
ChunkHeader take_chunk_header(ByteReader& in);
Footer take_footer(ByteReader in);

/// What a message's record has in front of its data, its own 9 bytes included.
inline constexpr std::size_t kMessageHeaderBytes = kRecordHeaderBytes + 22;

}  // namespace striper::wire
