// SPDX-License-Identifier: Apache-2.0
#include "wire/mcap_content.hpp"

#include <fmt/format.h>

namespace striper::wire {

void put_header(ByteWriter out, std::string_view profile, std::string_view library) {
  const std::size_t begun = out.begin(Opcode::kHeader);
  out.put(profile);
  out.put(library);
  out.end(begun);
}

void put_schema(ByteWriter out, std::uint16_t id, const McapSchema& schema) {
  const std::size_t begun = out.begin(Opcode::kSchema);
  out.put(id);
  out.put(std::string_view(schema.name));
  out.put(std::string_view(schema.encoding));
  out.put(std::string_view(schema.data));
  out.end(begun);
}

SchemaRecord take_schema(ByteReader in) {
  SchemaRecord record;
  record.id = in.take<std::uint16_t>();
  record.schema.name = in.take_text();
  record.schema.encoding = in.take_text();
  record.schema.data = in.take_text();
  return record;
}

void put_channel(ByteWriter out, std::uint16_t id, std::uint16_t schema_id,
                 const McapChannel& channel) {
  const std::size_t begun = out.begin(Opcode::kChannel);
  out.put(id);
  out.put(schema_id);
  out.put(std::string_view(channel.topic));
  out.put(std::string_view(channel.message_encoding));
  out.put(channel.metadata);
  out.end(begun);
}

ChannelRecord take_channel(ByteReader in) {
  ChannelRecord record;
  record.id = in.take<std::uint16_t>();
  record.schema_id = in.take<std::uint16_t>();
  record.channel.topic = in.take_text();
  record.channel.message_encoding = in.take_text();
  record.channel.metadata = in.take_map();
  return record;
}

void put_message(ByteWriter out, const McapMessage& message) {
  const std::size_t begun = out.begin(Opcode::kMessage);
  out.put(message.channel);
  out.put(message.sequence);
  out.put(message.log_time_ns);
  out.put(message.publish_time_ns);
  out.put(message.data);
  out.end(begun);
}

McapMessage take_message(ByteReader in) {
  McapMessage message;
  message.channel = in.take<std::uint16_t>();
  message.sequence = in.take<std::uint32_t>();
  message.log_time_ns = in.take<std::uint64_t>();
  message.publish_time_ns = in.take<std::uint64_t>();
  message.data = in.rest();
  return message;
}

void put_metadata(ByteWriter out, const McapMetadata& metadata) {
  const std::size_t begun = out.begin(Opcode::kMetadata);
  out.put(std::string_view(metadata.name));
  out.put(metadata.values);
  out.end(begun);
}

McapMetadata take_metadata(ByteReader in) {
  McapMetadata metadata;
  metadata.name = in.take_text();
  metadata.values = in.take_map();
  return metadata;
}

void put_attachment(Bytes& bytes, const McapAttachment& attachment) {
  ByteWriter out(bytes);
  const std::size_t begun = out.begin(Opcode::kAttachment);
  out.put(attachment.log_time_ns);
  out.put(attachment.create_time_ns);
  out.put(std::string_view(attachment.name));
  out.put(std::string_view(attachment.media_type));
  out.put(static_cast<std::uint64_t>(attachment.data.size()));
  bytes.insert(bytes.end(), attachment.data.begin(), attachment.data.end());
  out.put(crc32_of(ByteSpan(bytes).subspan(begun + kRecordHeaderBytes)));
  out.end(begun);
}

McapAttachment take_attachment(ByteReader in, ByteSpan content, const RecordPlace& place) {
  McapAttachment attachment;
  attachment.log_time_ns = in.take<std::uint64_t>();
  attachment.create_time_ns = in.take<std::uint64_t>();
  attachment.name = in.take_text();
  attachment.media_type = in.take_text();
  const ByteSpan data = in.take_bytes(in.take<std::uint64_t>());
  attachment.data.assign(data.begin(), data.end());
  const std::uint32_t crc = crc32_of(content.first(in.at()));
  const auto written = in.take<std::uint32_t>();
  if (written != 0 && written != crc) {
    refuse(place, fmt::format("its checksum is {:08x}, that of its content {:08x}", written, crc));
  }
  return attachment;
}

void put_statistics(ByteWriter out, const McapStatistics& statistics) {
  const std::size_t begun = out.begin(Opcode::kStatistics);
  out.put(statistics.messages);
  out.put(statistics.schemas);
  out.put(statistics.channels);
  out.put(statistics.attachments);
  out.put(statistics.metadata);
  out.put(statistics.chunks);
  out.put(statistics.start_ns);
  out.put(statistics.end_ns);
  out.put(static_cast<std::uint32_t>(10 * statistics.channel_messages.size()));
  for (const auto& [channel, messages] : statistics.channel_messages) {
    out.put(channel);
    out.put(messages);
  }
  out.end(begun);
}

McapStatistics take_statistics(ByteReader in) {
  McapStatistics statistics;
  statistics.messages = in.take<std::uint64_t>();
  statistics.schemas = in.take<std::uint16_t>();
  statistics.channels = in.take<std::uint32_t>();
  statistics.attachments = in.take<std::uint32_t>();
  statistics.metadata = in.take<std::uint32_t>();
  statistics.chunks = in.take<std::uint32_t>();
  statistics.start_ns = in.take<std::uint64_t>();
  statistics.end_ns = in.take<std::uint64_t>();
  for (auto left = in.take<std::uint32_t>(); left >= 10; left -= 10) {
    const auto channel = in.take<std::uint16_t>();
    statistics.channel_messages[channel] = in.take<std::uint64_t>();
  }
  return statistics;
}

void put_attachment_index(ByteWriter out, const AttachmentIndex& index) {
  const std::size_t begun = out.begin(Opcode::kAttachmentIndex);
  out.put(index.offset);
  out.put(index.length);
  out.put(index.about.log_time_ns);
  out.put(index.about.create_time_ns);
  out.put(index.data_bytes);
  out.put(std::string_view(index.about.name));
  out.put(std::string_view(index.about.media_type));
  out.end(begun);
}

AttachmentIndex take_attachment_index(ByteReader in) {
  AttachmentIndex index;
  index.offset = in.take<std::uint64_t>();
  index.length = in.take<std::uint64_t>();
  index.about.log_time_ns = in.take<std::uint64_t>();
  index.about.create_time_ns = in.take<std::uint64_t>();
  index.data_bytes = in.take<std::uint64_t>();
  index.about.name = in.take_text();
  index.about.media_type = in.take_text();
  return index;
}

ChunkHeader take_chunk_header(ByteReader& in) {
  ChunkHeader header;
  header.start_ns = in.take<std::uint64_t>();
  header.end_ns = in.take<std::uint64_t>();
  header.unpacked_bytes = in.take<std::uint64_t>();
  header.unpacked_crc = in.take<std::uint32_t>();
  header.compression = in.take_text();
  return header;
}

Footer take_footer(ByteReader in) {
  Footer footer;
  footer.summary_start = in.take<std::uint64_t>();
  footer.summary_offset_start = in.take<std::uint64_t>();
  footer.summary_crc = in.take<std::uint32_t>();
  return footer;
}

}  // namespace striper::wire
