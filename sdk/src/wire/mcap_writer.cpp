// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/wire/mcap_writer.hpp>

#include "wire/mcap_compression.hpp"
#include "wire/mcap_content.hpp"
#include "wire/mcap_file.hpp"

namespace striper::wire {
namespace {

constexpr std::uint64_t kNoTime = std::numeric_limits<std::uint64_t>::max();

/// A channel and the index of its messages in the open chunk.
struct OpenChannel {
  std::uint16_t schema_id = 0;
  McapChannel channel;
  bool is_written = false;
  Bytes index;  ///< Log time and offset in the chunk, 16 bytes a message.
};

/// The span of log times of the open chunk.
struct TimeSpan {
  std::uint64_t start = kNoTime;
  std::uint64_t end = 0;
  bool is_empty() const { return start == kNoTime; }
  void add(std::uint64_t time) {
    start = std::min(start, time);
    end = std::max(end, time);
  }
  std::uint64_t with(std::uint64_t time) const {
    return std::max(end, time) - std::min(start, time);
  }
};

}  // namespace

struct McapWriter::Impl {
  Impl(const std::filesystem::path& path, const McapWriterOptions& wanted)
      : options(wanted), file(path), packer(wanted.zstd_level) {
    chunk.reserve(options.chunk_bytes);
    const auto magic = reinterpret_cast<const std::uint8_t*>(kMcapMagic.data());
    out.assign(magic, magic + kMcapMagic.size());
    put_header(ByteWriter(out), options.profile, "striper " STRIPER_VERSION);
    file.append(out);
  }

  void write(const McapMessage& message);
  void flush();
  void attach(const McapAttachment& attachment);
  void add_metadata(const McapMetadata& metadata);
  void close();
  std::uint16_t schema_id(const McapSchema& schema);

  void put_new_channel(std::uint16_t id);
  void put_chunk();
  void append_out();
  void put_message_indexes(std::uint64_t chunk_length);
  void put_summary();
  void put_summary_offset(std::size_t group_begin, Bytes& offsets);

  McapWriterOptions options;
  CountedFile file;
  Packer packer;
  McapStatistics statistics;
  std::vector<McapSchema> schemas;  ///< By id - 1.
  std::size_t schemas_written = 0;
  std::vector<OpenChannel> channels;
  std::vector<std::uint64_t> channel_messages;
  Bytes chunk;  ///< The open chunk's records.
  TimeSpan times;
  Bytes out;  ///< What is written next.
  bool is_broken = false;
  Bytes chunk_indexes;
  Bytes attachment_indexes;
  Bytes metadata_indexes;
};

std::uint16_t McapWriter::Impl::schema_id(const McapSchema& schema) {
  if (schema.encoding.empty() && schema.name.empty()) return 0;
  const auto found = std::find(schemas.begin(), schemas.end(), schema);
  const auto id = static_cast<std::uint16_t>(found - schemas.begin() + 1);
  if (found == schemas.end()) schemas.push_back(schema);
  return id;
}

/// A channel stands in front of its first message, its schema in front of it.
void McapWriter::Impl::put_new_channel(std::uint16_t id) {
  OpenChannel& channel = channels[id];
  for (; schemas_written < channel.schema_id; ++schemas_written) {
    put_schema(ByteWriter(chunk), static_cast<std::uint16_t>(schemas_written + 1),
               schemas[schemas_written]);
  }
  put_channel(ByteWriter(chunk), id, channel.schema_id, channel.channel);
  channel.is_written = true;
}

void McapWriter::Impl::write(const McapMessage& message) {
  if (message.channel >= channels.size()) {
    throw Error(ErrorKind::kBadValue, fmt::format("{}: a message of channel {}; there are {}",
                                                  file.path(), message.channel, channels.size()));
  }
  const std::size_t size = kMessageHeaderBytes + message.data.size();
  if (!times.is_empty() && (chunk.size() + size > options.chunk_bytes ||
                            times.with(message.log_time_ns) > options.chunk_ns)) {
    flush();
  }
  OpenChannel& channel = channels[message.channel];
  if (!channel.is_written) put_new_channel(message.channel);
  ByteWriter index(channel.index);
  index.put(message.log_time_ns);
  index.put(static_cast<std::uint64_t>(chunk.size()));
  put_message(ByteWriter(chunk), message);
  times.add(message.log_time_ns);
  ++channel_messages[message.channel];
  ++statistics.messages;
}

/// The chunk's record at the front of `out`; uncompressed where that is no longer.
void McapWriter::Impl::put_chunk() {
  out.clear();
  ByteWriter writer(out);
  const std::size_t begun = writer.begin(Opcode::kChunk);
  writer.put(times.start);
  writer.put(times.end);
  writer.put(static_cast<std::uint64_t>(chunk.size()));
  writer.put(crc32_of(chunk));
  const std::size_t compression_at = out.size();
  writer.put(to_string(options.compression));
  const std::size_t length_at = out.size();
  writer.put(std::uint64_t{0});
  const std::size_t packed_at = out.size();
  if (options.compression != McapCompression::kNone && packer.pack(chunk, out)) {
    const std::uint64_t packed = out.size() - packed_at;
    for (std::size_t i = 0; i < 8; ++i)
      out[length_at + i] = static_cast<std::uint8_t>(packed >> (8 * i));
  } else {
    out.resize(compression_at);
    writer.put(to_string(McapCompression::kNone));
    writer.put(static_cast<std::uint64_t>(chunk.size()));
    writer.put(ByteSpan(chunk));
  }
  writer.end(begun);
}

/// The message indexes behind the chunk in `out`, and the chunk's own for the summary.
void McapWriter::Impl::put_message_indexes(std::uint64_t chunk_length) {
  const ChunkHeader header = [&] {
    ByteReader reader(ByteSpan(out).subspan(kRecordHeaderBytes),
                      {file.path(), "chunk", file.size()});
    return take_chunk_header(reader);
  }();
  ByteWriter index(chunk_indexes);
  const std::size_t begun = index.begin(Opcode::kChunkIndex);
  index.put(times.start);
  index.put(times.end);
  index.put(file.size());
  index.put(chunk_length);
  const auto used = std::count_if(channels.begin(), channels.end(),
                                  [](const OpenChannel& c) { return !c.index.empty(); });
  index.put(static_cast<std::uint32_t>(10 * used));
  ByteWriter writer(out);
  for (std::size_t id = 0; id < channels.size(); ++id) {
    Bytes& entries = channels[id].index;
    if (entries.empty()) continue;
    index.put(static_cast<std::uint16_t>(id));
    index.put(static_cast<std::uint64_t>(file.size() + out.size()));
    const std::size_t record = writer.begin(Opcode::kMessageIndex);
    writer.put(static_cast<std::uint16_t>(id));
    writer.put(static_cast<std::uint32_t>(entries.size()));
    writer.put(ByteSpan(entries));
    writer.end(record);
    entries.clear();
  }
  index.put(static_cast<std::uint64_t>(out.size() - chunk_length));
  index.put(std::string_view(header.compression));
  // Behind the header come its length and the bytes themselves.
  index.put(chunk_length - kRecordHeaderBytes - 8 - 8 - 8 - 4 - 4 - header.compression.size() - 8);
  index.put(header.unpacked_bytes);
  index.end(begun);
}

void McapWriter::Impl::flush() {
  if (times.is_empty()) return;
  put_chunk();
  put_message_indexes(out.size());
  const bool is_first = statistics.chunks == 0;
  statistics.start_ns = is_first ? times.start : std::min(statistics.start_ns, times.start);
  statistics.end_ns = is_first ? times.end : std::max(statistics.end_ns, times.end);
  ++statistics.chunks;
  chunk.clear();
  times = {};
  append_out();
}

/// Behind a failure nothing more is written, the summary neither: it would speak of what is not
/// there.
void McapWriter::Impl::append_out() {
  if (is_broken)
    throw Error(ErrorKind::kIo, file.path() + ": could not be written before and is not any more");
  is_broken = true;
  file.append(out);
  is_broken = false;
}

void McapWriter::Impl::attach(const McapAttachment& attachment) {
  out.clear();
  put_attachment(out, attachment);
  AttachmentIndex index{file.size(), out.size(), attachment, attachment.data.size()};
  index.about.data.clear();
  append_out();
  put_attachment_index(ByteWriter(attachment_indexes), index);
  ++statistics.attachments;
}

void McapWriter::Impl::add_metadata(const McapMetadata& metadata) {
  out.clear();
  put_metadata(ByteWriter(out), metadata);
  ByteWriter index(metadata_indexes);
  const std::uint64_t offset = file.size();
  append_out();
  const std::size_t begun = index.begin(Opcode::kMetadataIndex);
  index.put(offset);
  index.put(static_cast<std::uint64_t>(out.size()));
  index.put(std::string_view(metadata.name));
  index.end(begun);
  ++statistics.metadata;
}

/// Says in `offsets` where the group of records is that was just put.
void McapWriter::Impl::put_summary_offset(std::size_t group_begin, Bytes& offsets) {
  if (out.size() == group_begin) return;
  ByteWriter writer(offsets);
  const std::size_t begun = writer.begin(Opcode::kSummaryOffset);
  writer.put(out[group_begin]);
  writer.put(static_cast<std::uint64_t>(file.size() + group_begin));
  writer.put(static_cast<std::uint64_t>(out.size() - group_begin));
  writer.end(begun);
}

/// Schemas, channels, statistics, indexes: each kind a group, and where the groups are.
void McapWriter::Impl::put_summary() {
  out.clear();
  ByteWriter writer(out);
  Bytes offsets;
  std::size_t group = 0;
  const auto end_group = [&] {
    put_summary_offset(group, offsets);
    group = out.size();
  };
  for (std::size_t i = 0; i < schemas_written; ++i)
    put_schema(writer, static_cast<std::uint16_t>(i + 1), schemas[i]);
  end_group();
  for (std::size_t id = 0; id < channels.size(); ++id) {
    if (!channels[id].is_written) continue;
    put_channel(writer, static_cast<std::uint16_t>(id), channels[id].schema_id,
                channels[id].channel);
    statistics.channel_messages[static_cast<std::uint16_t>(id)] = channel_messages[id];
    ++statistics.channels;
  }
  end_group();
  statistics.schemas = static_cast<std::uint16_t>(schemas_written);
  put_statistics(writer, statistics);
  end_group();
  for (const Bytes* index : {&chunk_indexes, &attachment_indexes, &metadata_indexes}) {
    writer.put(ByteSpan(*index));
    end_group();
  }
  const std::uint64_t offsets_at = file.size() + out.size();
  writer.put(ByteSpan(offsets));
  const std::size_t begun = writer.begin(Opcode::kFooter);
  writer.put(file.size());
  writer.put(offsets_at);
  // The checksum is of all that, the footer's own length included.
  out[begun + 1] = kFooterBytes;
  writer.put(crc32_of(out));
  out.insert(out.end(), kMcapMagic.begin(), kMcapMagic.end());
}

void McapWriter::Impl::close() {
  if (!file.is_open()) return;
  if (is_broken) return file.close();
  flush();
  out.clear();
  ByteWriter writer(out);
  const std::size_t begun = writer.begin(Opcode::kDataEnd);
  writer.put(file.crc());
  writer.end(begun);
  append_out();
  put_summary();
  append_out();
  file.close();
}

McapWriter::McapWriter(const std::filesystem::path& path, const McapWriterOptions& options) {
  if (options.compression == McapCompression::kLz4) {
    throw Error(ErrorKind::kUnsupported,
                path.string() + ": lz4 is read only; write zstd, or no compression");
  }
  require_compression(options.compression, path.string());
  impl_ = std::make_unique<Impl>(path, options);
}

McapWriter::~McapWriter() {
  try {
    close();
  } catch (...) {  // NOLINT(bugprone-empty-catch): said in the header.
  }
}

std::uint16_t McapWriter::add_channel(const McapChannel& channel) {
  if (impl_->channels.size() > std::numeric_limits<std::uint16_t>::max()) {
    throw Error(ErrorKind::kBadValue, impl_->file.path() + ": more than 65536 channels");
  }
  OpenChannel open;
  open.schema_id = impl_->schema_id(channel.schema);
  open.channel = channel;
  impl_->channels.push_back(std::move(open));
  impl_->channel_messages.push_back(0);
  return static_cast<std::uint16_t>(impl_->channels.size() - 1);
}

void McapWriter::write(const McapMessage& message) { impl_->write(message); }
void McapWriter::attach(const McapAttachment& attachment) { impl_->attach(attachment); }
void McapWriter::add_metadata(const McapMetadata& metadata) { impl_->add_metadata(metadata); }
void McapWriter::flush() { impl_->flush(); }
void McapWriter::close() { impl_->close(); }
const McapStatistics& McapWriter::statistics() const noexcept { return impl_->statistics; }
std::uint64_t McapWriter::bytes() const noexcept {
  return impl_->file.size() + impl_->chunk.size();
}

}  // namespace striper::wire
