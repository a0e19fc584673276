// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/wire/mcap_reader.hpp>

#include "wire/mcap_compression.hpp"
#include "wire/mcap_content.hpp"
#include "wire/mcap_file.hpp"

namespace striper::wire {
namespace {

/// What a record says of itself, and where it lies in the file.
struct RecordHead {
  Opcode opcode{};
  std::uint64_t offset = 0;
  std::uint64_t length = 0;  ///< Of the content.
  std::uint64_t content() const { return offset + kRecordHeaderBytes; }
  std::uint64_t end() const { return content() + length; }
};

/// Bytes that are read through for the checksum only come in pieces of this size.
constexpr std::size_t kPieceBytes = 1 << 20;

}  // namespace

struct McapReader::Impl {
  Impl(const std::filesystem::path& path, const McapReaderOptions& wanted);
  bool next(McapMessage& message);
  McapAttachment read_attachment(std::size_t index);

  // The file's frame.
  void read_head();
  void find_extras();
  bool read_summary(std::uint64_t footer_at);
  void take_summary_record(const RecordHead& head, ByteReader content);
  void walk_records();
  std::optional<RecordHead> record_at(std::uint64_t offset);
  ByteSpan load(const RecordHead& head, Bytes& into);
  void read_extra(const RecordHead& head);
  void add_attachment(const RecordHead& head);

  // The stream of messages.
  bool take_from_chunk(McapMessage& message);
  bool read_record(McapMessage& message, bool& has_message);
  void take_record(const RecordHead& head, McapMessage& message, bool& has_message);
  void open_chunk(const RecordHead& head, ByteSpan content);
  void pass_over(const RecordHead& head);
  void check_data_end(const RecordHead& head, ByteSpan content);
  void add_schema(SchemaRecord given, const RecordPlace& where);
  void add_channel(ChannelRecord given, const RecordPlace& where);
  void require_known(const McapMessage& message, const RecordPlace& where) const;
  void finish(McapEnd how);
  void note_damage(const RecordHead& head, const std::string& reason);

  RecordPlace place(const RecordHead& head) const {
    return {file.path(), to_string(head.opcode), head.offset};
  }

  McapReaderOptions options;
  ReadFile file;
  Unpacker unpacker;
  std::string profile;
  std::string library;
  std::map<std::uint16_t, McapSchema> schemas;
  std::map<std::uint16_t, McapChannel> channels;
  std::optional<McapStatistics> statistics;
  std::vector<McapMetadata> metadata;
  std::vector<McapAttachment> attachments;
  std::vector<RecordHead> attachment_heads;
  bool has_end = false;  ///< The file ends as it should: footer and magic.

  std::uint64_t summary_at = 0;  ///< What comes behind the data: the summary, or the footer.
  std::uint64_t at = 0;          ///< Of the next record.
  std::uint32_t crc = 0;         ///< Of all bytes before `at`.
  Bytes record;
  Bytes unpacked;
  ByteSpan chunk;  ///< What is left of the open chunk: in `record` or `unpacked`.
  RecordHead chunk_head;
  McapEnd end = McapEnd::kUnread;
  RecordHead current;               ///< What is being read.
  bool is_summary_damaged = false;  ///< Then the file does not say how it ends.
  std::vector<McapDamage> damages;
};

McapReader::Impl::Impl(const std::filesystem::path& path, const McapReaderOptions& wanted)
    : options(wanted), file(path) {
  read_head();
  find_extras();
}

void McapReader::Impl::note_damage(const RecordHead& head, const std::string& reason) {
  damages.push_back({head.offset, std::min(head.end(), file.size()) - head.offset, reason});
}

/// The record's opcode and length; nothing where the file ends within the record.
std::optional<RecordHead> McapReader::Impl::record_at(std::uint64_t offset) {
  if (offset > file.size() || file.size() - offset < kRecordHeaderBytes) return std::nullopt;
  std::array<std::uint8_t, kRecordHeaderBytes> bytes;
  file.read(offset, bytes);
  ByteReader reader(bytes, {file.path(), "record", offset});
  RecordHead head;
  head.offset = offset;
  head.opcode = static_cast<Opcode>(reader.take<std::uint8_t>());
  head.length = reader.take<std::uint64_t>();
  if (head.opcode == Opcode{}) refuse(place(head), "its kind is 0, which is none");
  if (head.length > file.size() - head.content()) {
    if (has_end)
      refuse(place(head), fmt::format("says it has {} bytes, the file has {} more", head.length,
                                      file.size() - head.content()));
    return std::nullopt;
  }
  return head;
}

ByteSpan McapReader::Impl::load(const RecordHead& head, Bytes& into) {
  // A chunk's own header and the names in it: well under a page.
  if (head.length > options.max_chunk_bytes + 4096) {
    refuse(place(head),
           fmt::format("has {} bytes; at most {} are read", head.length, options.max_chunk_bytes));
  }
  into.resize(head.length);
  file.read(head.content(), into);
  return into;
}

void McapReader::Impl::read_head() {
  Bytes magic(std::min<std::uint64_t>(kMcapMagic.size(), file.size()));
  file.read(0, magic);
  if (!std::equal(magic.begin(), magic.end(), kMcapMagic.begin(), kMcapMagic.end(),
                  [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); })) {
    throw Error(ErrorKind::kBadFile, fmt::format("{}: does not begin as an MCAP file ({} bytes)",
                                                 file.path(), file.size()));
  }
  const auto head = record_at(kMcapMagic.size());
  if (!head) throw Error(ErrorKind::kBadFile, file.path() + ": ends within its header");
  if (head->opcode != Opcode::kHeader) refuse(place(*head), "stands where the header is expected");
  ByteReader content(load(*head, record), place(*head));
  profile = content.take_text();
  library = content.take_text();
  at = kMcapMagic.size();
  crc = crc32_of(magic);
}

/// Channels, statistics, attachments and metadata from the summary; without one attachments and
/// metadata by a walk.
void McapReader::Impl::find_extras() {
  constexpr std::uint64_t kEndBytes = kRecordHeaderBytes + kFooterBytes + 8;
  if (file.size() >= kMcapMagic.size() + kEndBytes) {
    Bytes magic(kMcapMagic.size());
    file.read(file.size() - magic.size(), magic);
    has_end = std::equal(magic.begin(), magic.end(),
                         reinterpret_cast<const std::uint8_t*>(kMcapMagic.data()));
  }
  try {
    if (!has_end || !read_summary(file.size() - kEndBytes)) walk_records();
  } catch (const Error& error) {
    if (!options.skip_damaged || error.kind() != ErrorKind::kBadFile) throw;
    is_summary_damaged = true;  // Nothing is lost that the records do not say too.
    damages.push_back({summary_at, 0, error.what()});
    // Nothing of a damaged summary is believed; has_end neither, so that the walk ends where
    // records do.
    schemas.clear();
    channels.clear();
    statistics.reset();
    attachments.clear();
    attachment_heads.clear();
    metadata.clear();
    has_end = false;
    walk_records();
  }
}

/// False where the file has no summary.
bool McapReader::Impl::read_summary(std::uint64_t footer_at) {
  const auto head = record_at(footer_at);
  if (!head || head->opcode != Opcode::kFooter || head->length != kFooterBytes) {
    refuse({file.path(), "footer", footer_at}, "is none");
  }
  const Footer footer = take_footer(ByteReader(load(*head, record), place(*head)));
  summary_at = footer.summary_start == 0 ? footer_at : footer.summary_start;
  if (footer.summary_start == 0) return false;
  if (footer.summary_start > footer_at ||
      footer_at - footer.summary_start > options.max_chunk_bytes) {
    refuse(place(*head), fmt::format("the summary cannot begin at byte {}", footer.summary_start));
  }
  // The checksum goes up to itself.
  Bytes summary(footer_at - footer.summary_start + kRecordHeaderBytes + 16);
  file.read(footer.summary_start, summary);
  const std::uint32_t summary_crc = crc32_of(summary);
  if (footer.summary_crc != 0 && footer.summary_crc != summary_crc) {
    refuse(place(*head), fmt::format("its checksum of the summary is {:08x}, the summary's {:08x}",
                                     footer.summary_crc, summary_crc));
  }
  for (std::uint64_t offset = footer.summary_start; offset < footer_at;) {
    const auto record_head = record_at(offset);
    if (!record_head || record_head->end() > footer_at)
      refuse({file.path(), "summary", offset}, "ends within a record");
    const ByteSpan content = ByteSpan(summary).subspan(
        record_head->content() - footer.summary_start, record_head->length);
    take_summary_record(*record_head, ByteReader(content, place(*record_head)));
    offset = record_head->end();
  }
  return true;
}

void McapReader::Impl::take_summary_record(const RecordHead& head, ByteReader content) {
  switch (head.opcode) {
    case Opcode::kSchema:
      return add_schema(take_schema(content), place(head));
    case Opcode::kChannel:
      return add_channel(take_channel(content), place(head));
    case Opcode::kStatistics:
      statistics = take_statistics(content);
      return;
    case Opcode::kAttachmentIndex:
    case Opcode::kMetadataIndex: {
      const auto there = record_at(content.take<std::uint64_t>());
      if (!there) refuse(place(head), "points behind the end of the file");
      return read_extra(*there);
    }
    default:
      return;
  }
}

void McapReader::Impl::read_extra(const RecordHead& head) {
  if (head.opcode == Opcode::kAttachment) {
    add_attachment(head);
  } else if (head.opcode == Opcode::kMetadata) {
    Bytes content;
    metadata.push_back(take_metadata(ByteReader(load(head, content), place(head))));
  }
}

/// Its names only: those that lie in the record's first 64 KiB.
void McapReader::Impl::add_attachment(const RecordHead& head) {
  Bytes begin(std::min<std::uint64_t>(head.length, 1 << 16));
  file.read(head.content(), begin);
  ByteReader content(begin, place(head));
  McapAttachment about;
  about.log_time_ns = content.take<std::uint64_t>();
  about.create_time_ns = content.take<std::uint64_t>();
  about.name = content.take_text();
  about.media_type = content.take_text();
  attachments.push_back(std::move(about));
  attachment_heads.push_back(head);
}

void McapReader::Impl::walk_records() {
  std::uint64_t offset = kMcapMagic.size();
  while (const auto head = record_at(offset)) {
    if (head->opcode == Opcode::kDataEnd || head->opcode == Opcode::kFooter) return;
    read_extra(*head);
    offset = head->end();
  }
}

McapAttachment McapReader::Impl::read_attachment(std::size_t index) {
  const RecordHead& head = attachment_heads.at(index);
  Bytes bytes;
  const ByteSpan content = load(head, bytes);
  return take_attachment(ByteReader(content, place(head)), content, place(head));
}

void McapReader::Impl::add_schema(SchemaRecord given, const RecordPlace& where) {
  if (given.id == 0) refuse(where, "its number is 0, which stands for none");
  const auto [found, is_new] = schemas.try_emplace(given.id, given.schema);
  if (!is_new && found->second != given.schema) {
    refuse(where, fmt::format("is another of number {}", given.id));
  }
}

void McapReader::Impl::add_channel(ChannelRecord given, const RecordPlace& where) {
  if (given.schema_id != 0) {
    const auto schema = schemas.find(given.schema_id);
    if (schema == schemas.end())
      refuse(where, fmt::format("there is no schema {}", given.schema_id));
    given.channel.schema = schema->second;
  }
  const auto [found, is_new] = channels.try_emplace(given.id, given.channel);
  if (!is_new && found->second != given.channel) {
    refuse(where, fmt::format("is another of number {}", given.id));
  }
}

void McapReader::Impl::require_known(const McapMessage& message, const RecordPlace& where) const {
  if (!channels.contains(message.channel))
    refuse(where, fmt::format("there is no channel {}", message.channel));
}

void McapReader::Impl::finish(McapEnd how) {
  if (end != McapEnd::kUnread) return;
  end = how;
  if (how != McapEnd::kCut || !options.skip_damaged || is_summary_damaged) return;
  damages.push_back({at, file.size() - at,
                     fmt::format("{}: ends at byte {} without its end: its writer died, or it was "
                                 "copied in part",
                                 file.path(), file.size())});
}

bool McapReader::Impl::next(McapMessage& message) {
  while (end == McapEnd::kUnread) {
    bool has_message = false;
    try {
      if (chunk.empty() ? read_record(message, has_message) && has_message
                        : take_from_chunk(message))
        return true;
    } catch (const Error& error) {
      // What a chunk had in front of its damage was delivered; the rest of it is left out.
      chunk = {};
      if (!options.skip_damaged || error.kind() != ErrorKind::kBadFile) throw;
      note_damage(current, error.what());
    }
  }
  return false;
}

/// A record of the open chunk; true where it is a message.
bool McapReader::Impl::take_from_chunk(McapMessage& message) {
  RecordPlace where{file.path(), "chunk", chunk_head.offset};
  ByteReader reader(chunk, where);
  const auto opcode = static_cast<Opcode>(reader.take<std::uint8_t>());
  const ByteSpan content = reader.take_bytes(reader.take<std::uint64_t>());
  chunk = chunk.subspan(reader.at());
  where.what = to_string(opcode);
  if (opcode == Opcode::kSchema) add_schema(take_schema(ByteReader(content, where)), where);
  if (opcode == Opcode::kChannel) add_channel(take_channel(ByteReader(content, where)), where);
  if (opcode != Opcode::kMessage) return false;
  message = take_message(ByteReader(content, where));
  require_known(message, where);
  return true;
}

/// The next record of the file; false at its end.
bool McapReader::Impl::read_record(McapMessage& message, bool& has_message) {
  current = {{}, at, file.size() - at};
  std::optional<RecordHead> head;
  try {
    head = record_at(at);
  } catch (const Error&) {
    if (end == McapEnd::kUnread) end = McapEnd::kCut;  // There is no way on from here.
    throw;
  }
  if (!head) {
    finish(McapEnd::kCut);
    return false;
  }
  current = *head;
  at = head->end();
  take_record(*head, message, has_message);
  return true;
}

void McapReader::Impl::take_record(const RecordHead& head, McapMessage& message,
                                   bool& has_message) {
  switch (head.opcode) {
    case Opcode::kSchema:
    case Opcode::kChannel:
    case Opcode::kMessage:
    case Opcode::kChunk:
    case Opcode::kDataEnd:
      break;
    case Opcode::kFooter:
      finish(McapEnd::kCut);
      refuse(place(head), "stands where the end of the data is expected");
    default:
      return pass_over(head);
  }
  const ByteSpan content = load(head, record);
  if (head.opcode == Opcode::kDataEnd) return check_data_end(head, content);
  std::array<std::uint8_t, kRecordHeaderBytes> begin;
  file.read(head.offset, begin);
  crc = crc32_of(content, crc32_of(begin, crc));
  const ByteReader reader(content, place(head));
  if (head.opcode == Opcode::kChunk) return open_chunk(head, content);
  if (head.opcode == Opcode::kSchema) return add_schema(take_schema(reader), place(head));
  if (head.opcode == Opcode::kChannel) return add_channel(take_channel(reader), place(head));
  message = take_message(reader);
  require_known(message, place(head));
  has_message = true;
}

/// Only its checksum matters.
void McapReader::Impl::pass_over(const RecordHead& head) {
  for (std::uint64_t offset = head.offset; offset < head.end();) {
    record.resize(std::min<std::uint64_t>(kPieceBytes, head.end() - offset));
    file.read(offset, record);
    crc = crc32_of(record, crc);
    offset += record.size();
  }
}

void McapReader::Impl::check_data_end(const RecordHead& head, ByteSpan content) {
  finish(has_end ? McapEnd::kWhole : McapEnd::kCut);
  if (has_end && head.end() != summary_at) {
    refuse(place(head),
           fmt::format("ends at byte {}, what follows begins at {}", head.end(), summary_at));
  }
  ByteReader reader(content, place(head));
  const auto written = reader.take<std::uint32_t>();
  if (written != 0 && written != crc && damages.empty()) {
    refuse(place(head), fmt::format("its checksum of the data is {:08x}, that of the data {:08x}",
                                    written, crc));
  }
}

void McapReader::Impl::open_chunk(const RecordHead& head, ByteSpan content) {
  ByteReader reader(content, place(head));
  const ChunkHeader header = take_chunk_header(reader);
  const ByteSpan packed = reader.take_bytes(reader.take<std::uint64_t>());
  const auto compression = compression_from_string(header.compression);
  if (!compression) {
    throw Error(
        ErrorKind::kUnsupported,
        fmt::format("{}: the chunk at byte {} is compressed by '{}'; zstd, lz4 and none are read",
                    file.path(), head.offset, header.compression));
  }
  require_compression(*compression, file.path());
  if (header.unpacked_bytes > options.max_chunk_bytes) {
    refuse(place(head), fmt::format("has {} bytes unpacked; at most {} are read",
                                    header.unpacked_bytes, options.max_chunk_bytes));
  }
  ByteSpan records = packed;
  if (*compression != McapCompression::kNone) {
    unpacked.resize(header.unpacked_bytes);
    const std::string fault = unpacker.unpack(*compression, packed, unpacked);
    if (!fault.empty()) refuse(place(head), fault);
    records = unpacked;
  }
  const std::uint32_t records_crc = crc32_of(records);
  if (records.size() != header.unpacked_bytes ||
      (header.unpacked_crc != 0 && header.unpacked_crc != records_crc)) {
    refuse(place(head), fmt::format("its checksum is {:08x}, that of its {} bytes {:08x}",
                                    header.unpacked_crc, records.size(), records_crc));
  }
  chunk = records;
  chunk_head = head;
}

McapReader::McapReader(const std::filesystem::path& path, const McapReaderOptions& options)
    : impl_(std::make_unique<Impl>(path, options)) {}
McapReader::~McapReader() = default;

const std::string& McapReader::profile() const noexcept { return impl_->profile; }
const std::string& McapReader::library() const noexcept { return impl_->library; }
const std::map<std::uint16_t, McapChannel>& McapReader::channels() const noexcept {
  return impl_->channels;
}
const std::optional<McapStatistics>& McapReader::statistics() const noexcept {
  return impl_->statistics;
}
const std::vector<McapMetadata>& McapReader::metadata() const noexcept { return impl_->metadata; }
const std::vector<McapAttachment>& McapReader::attachments() const noexcept {
  return impl_->attachments;
}
McapAttachment McapReader::read_attachment(std::size_t index) {
  return impl_->read_attachment(index);
}
bool McapReader::next(McapMessage& message) { return impl_->next(message); }
McapEnd McapReader::end() const noexcept { return impl_->end; }
std::uint64_t McapReader::whole_bytes() const noexcept { return impl_->at; }
const std::vector<McapDamage>& McapReader::damages() const noexcept { return impl_->damages; }

}  // namespace striper::wire
