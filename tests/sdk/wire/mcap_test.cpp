// SPDX-License-Identifier: Apache-2.0
// Proves: what is written comes back, compressed or not; the file has the chunks, statistics and
// extras that were asked for; files that other programs write, without chunks, summary or
// checksums, with lz4, are read; nothing is allocated per message. That other programs read ours is
// tests/foreign's business.
#include <algorithm>
#include <cstring>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/allocation_counter.hpp"
#include "support/error_of.hpp"
#include "support/mcap_files.hpp"
#include "support/scratch_directory.hpp"
#include "wire/mcap_compression.hpp"
#include "wire/mcap_content.hpp"

#ifdef STRIPER_WITH_LZ4
#include <lz4frame.h>
#endif

namespace striper::wire {
namespace {

using striper::testing::error_of;
using striper::testing::KeptMessage;
using striper::testing::read_mcap;
using striper::testing::ScratchDirectory;
using striper::testing::write_mcap;
using ::testing::HasSubstr;

class McapCompressions : public ::testing::TestWithParam<McapCompression> {};
INSTANTIATE_TEST_SUITE_P(All, McapCompressions,
                         ::testing::Values(McapCompression::kNone, McapCompression::kZstd));

TEST_P(McapCompressions, MessagesComeBack) {
  if (!has_compression(GetParam())) GTEST_SKIP() << "built without zstd";
  const ScratchDirectory scratch;
  const auto written =
      write_mcap(scratch / "a.mcap", 400, 5000, {.compression = GetParam(), .chunk_bytes = 20000});
  const auto read = read_mcap(scratch / "a.mcap");
  EXPECT_EQ(read.messages, written);
  EXPECT_EQ(read.end, McapEnd::kWhole);
}

TEST(Mcap, SummaryTellsWhatIsInTheFile) {
  const ScratchDirectory scratch;
  write_mcap(scratch / "a.mcap", 101, 3000, {.chunk_bytes = 10000});
  McapReader reader(scratch / "a.mcap");
  EXPECT_EQ(reader.profile(), "ros2");
  EXPECT_THAT(reader.library(), HasSubstr("striper"));
  ASSERT_TRUE(reader.statistics());
  EXPECT_EQ(reader.statistics()->messages, 101U);
  EXPECT_EQ(reader.statistics()->schemas, 2U);
  EXPECT_EQ(reader.statistics()->channels, 2U);
  EXPECT_EQ(reader.statistics()->attachments, 1U);
  EXPECT_EQ(reader.statistics()->metadata, 1U);
  EXPECT_GT(reader.statistics()->chunks, 10U);
  EXPECT_EQ(reader.statistics()->start_ns, 1'000'000'000U);
  EXPECT_EQ(reader.statistics()->end_ns, 2'000'000'000U);
  EXPECT_EQ(reader.statistics()->channel_messages.at(0), 51U);
  EXPECT_EQ(reader.statistics()->channel_messages.at(1), 50U);
  EXPECT_EQ(reader.channels().at(0), ros_channel("/striper/polar_scan", schema_of<PolarScan>()));
  ASSERT_EQ(reader.metadata().size(), 1U);
  EXPECT_EQ(reader.metadata()[0].values.at("frame_info"), "1");
  ASSERT_EQ(reader.attachments().size(), 1U);
  const McapAttachment model = reader.read_attachment(0);
  EXPECT_EQ(model.name, "head/striper.yaml");
  EXPECT_EQ(model.data, "striper_model: 1\n");
  EXPECT_EQ(model.create_time_ns, 6U);
}

TEST(Mcap, AChunkClosesAtItsSizeAndAtHalfASecond) {
  const ScratchDirectory scratch;
  write_mcap(scratch / "time.mcap", 200, 10);  // 2 s in steps of 10 ms: 51 messages span .5 s.
  EXPECT_EQ(McapReader(scratch / "time.mcap").statistics()->chunks, 4U);
  McapWriter writer(scratch / "size.mcap", {.compression = McapCompression::kNone});
  writer.add_channel(ros_channel("/a", schema_of<Event>()));
  const Bytes data(400'000);
  for (std::uint32_t i = 0; i < 9; ++i) writer.write({0, i, 5, 5, data});
  writer.close();
  EXPECT_EQ(writer.statistics().chunks, 5U);  // Two of them fit into 1 MiB.
}

TEST(Mcap, AMessageLargerThanAChunkGetsOneOfItsOwn) {
  const ScratchDirectory scratch;
  const auto written = write_mcap(scratch / "a.mcap", 20, 90'000, {.chunk_bytes = 1000});
  EXPECT_EQ(read_mcap(scratch / "a.mcap").messages, written);
}

TEST(Mcap, AnEmptyRecordingIsAFile) {
  const ScratchDirectory scratch;
  McapWriter(scratch / "a.mcap").close();
  McapReader reader(scratch / "a.mcap");
  McapMessage message;
  EXPECT_FALSE(reader.next(message));
  EXPECT_EQ(reader.end(), McapEnd::kWhole);
  EXPECT_EQ(reader.statistics()->messages, 0U);
}

TEST(Mcap, AllocatesNothingPerMessage) {
  const ScratchDirectory scratch;
  McapWriter writer(scratch / "a.mcap", {.chunk_bytes = 100'000});
  writer.add_channel(ros_channel("/a", schema_of<Event>()));
  const Bytes data(1000);
  std::uint32_t sequence = 0;
  const auto write_some = [&] {
    for (int i = 0; i < 990; ++i, ++sequence) writer.write({0, sequence, 5, 5, data});
  };
  write_some();
  const striper::testing::AllocationCounter counter;
  write_some();
  // Ten chunks; the list of them for the summary may have doubled once.
  EXPECT_LE(counter.count(), 1U);
  writer.close();
}

TEST(Mcap, AFullDiskLeavesWholeChunks) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "needs /dev/full";
  EXPECT_EQ(error_of([] { McapWriter writer("/dev/full"); }).kind(), ErrorKind::kIo);
}

TEST(Mcap, RefusesWhatItCannotDo) {
  const ScratchDirectory scratch;
  EXPECT_EQ(error_of([&] {
              McapWriter(scratch / "a.mcap", {.compression = McapCompression::kLz4});
            }).kind(),
            ErrorKind::kUnsupported);
  EXPECT_EQ(error_of([&] { McapWriter(scratch / "none" / "a.mcap"); }).kind(), ErrorKind::kIo);
  EXPECT_EQ(error_of([&] { McapReader(scratch / "none.mcap"); }).kind(), ErrorKind::kNotFound);
  EXPECT_EQ(error_of([&] { McapReader(scratch.path()); }).kind(), ErrorKind::kBadFile);
  McapWriter writer(scratch / "a.mcap");
  EXPECT_EQ(error_of([&] { writer.write({3, 0, 0, 0, {}}); }).kind(), ErrorKind::kBadValue);
}

// Files as other programs may write them, put together record by record.
class ForeignFile {
 public:
  ForeignFile() : bytes_(kMcapMagic.begin(), kMcapMagic.end()) {
    put_header(ByteWriter(bytes_), "", "somebody's 1.0");
  }
  ByteWriter out() { return ByteWriter(bytes_); }
  void chunk(std::string_view compression, ByteSpan packed, ByteSpan records, std::uint32_t crc) {
    ByteWriter writer(bytes_);
    const std::size_t begun = writer.begin(Opcode::kChunk);
    writer.put(std::uint64_t{1});
    writer.put(std::uint64_t{2});
    writer.put(static_cast<std::uint64_t>(records.size()));
    writer.put(crc);
    writer.put(compression);
    writer.put(static_cast<std::uint64_t>(packed.size()));
    writer.put(packed);
    writer.end(begun);
  }
  /// Data end and footer without summary, checksums 0.
  void end() {
    ByteWriter writer(bytes_);
    const std::size_t data_end = writer.begin(Opcode::kDataEnd);
    writer.put(std::uint32_t{0});
    writer.end(data_end);
    const std::size_t footer = writer.begin(Opcode::kFooter);
    for (int word = 0; word < 5; ++word) writer.put(std::uint32_t{0});
    writer.end(footer);
    bytes_.insert(bytes_.end(), kMcapMagic.begin(), kMcapMagic.end());
  }
  void save(const std::filesystem::path& path) const {
    striper::testing::write_bytes(path, std::string(bytes_.begin(), bytes_.end()));
  }

 private:
  Bytes bytes_;
};

/// A schema-less channel of JSON and two messages.
Bytes some_records() {
  Bytes records;
  put_channel(ByteWriter(records), 7, 0, {"/chatter", "json", {}, {}});
  const std::string text = R"({"a": 1})";
  const ByteSpan data(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  put_message(ByteWriter(records), {7, 0, 1, 1, data});
  put_message(ByteWriter(records), {7, 1, 2, 2, data});
  return records;
}

TEST(McapOfOthers, WithoutChunksSummaryAndChecksumsIsRead) {
  const ScratchDirectory scratch;
  ForeignFile file;
  file.out().put(ByteSpan(some_records()));
  file.end();
  file.save(scratch / "a.mcap");
  const auto read = read_mcap(scratch / "a.mcap");
  ASSERT_EQ(read.messages.size(), 2U);
  EXPECT_EQ(read.messages[1].topic, "/chatter");
  EXPECT_EQ(read.messages[1].sequence, 1U);
  EXPECT_EQ(read.end, McapEnd::kWhole);
  EXPECT_EQ(McapReader(scratch / "a.mcap").profile(), "");
}

TEST(McapOfOthers, RecordsOfKindsToComeArePassedOver) {
  const ScratchDirectory scratch;
  ForeignFile file;
  ByteWriter out = file.out();
  const std::size_t begun = out.begin(Opcode{0x80});
  out.put(std::string_view("of tomorrow"));
  out.end(begun);
  out.put(ByteSpan(some_records()));
  file.end();
  file.save(scratch / "a.mcap");
  EXPECT_EQ(read_mcap(scratch / "a.mcap").messages.size(), 2U);
}

#ifdef STRIPER_WITH_LZ4
TEST(McapOfOthers, Lz4IsRead) {
  const ScratchDirectory scratch;
  const Bytes records = some_records();
  Bytes packed(LZ4F_compressFrameBound(records.size(), nullptr));
  packed.resize(
      LZ4F_compressFrame(packed.data(), packed.size(), records.data(), records.size(), nullptr));
  ForeignFile file;
  file.chunk("lz4", packed, records, crc32_of(records));
  file.end();
  file.save(scratch / "a.mcap");
  EXPECT_EQ(read_mcap(scratch / "a.mcap").messages.size(), 2U);

  ForeignFile cut;
  cut.chunk("lz4", ByteSpan(packed).first(packed.size() - 5), records, crc32_of(records));
  cut.end();
  cut.save(scratch / "b.mcap");
  EXPECT_THAT(error_of([&] { read_mcap(scratch / "b.mcap"); }).what(),
              HasSubstr("lz4: the frame does not end"));
}
#endif

TEST(McapOfOthers, AnUnknownCompressionIsNamed) {
  const ScratchDirectory scratch;
  ForeignFile file;
  file.chunk("brotli", some_records(), some_records(), 0);
  file.end();
  file.save(scratch / "a.mcap");
  const Error error = error_of([&] { read_mcap(scratch / "a.mcap"); });
  EXPECT_EQ(error.kind(), ErrorKind::kUnsupported);
  EXPECT_THAT(error.what(), HasSubstr("compressed by 'brotli'; zstd, lz4 and none are read"));
}

TEST(McapOfOthers, AMessageNeedsAChannelAndAChannelItsSchema) {
  const ScratchDirectory scratch;
  ForeignFile file;
  put_message(file.out(), {9, 0, 1, 1, {}});
  put_channel(file.out(), 1, 4, {"/a", "cdr", {}, {}});
  file.out().put(ByteSpan(some_records()));
  file.end();
  file.save(scratch / "a.mcap");
  EXPECT_THAT(error_of([&] { read_mcap(scratch / "a.mcap"); }).what(),
              HasSubstr("there is no channel 9"));
  McapReader reader(scratch / "a.mcap", {.skip_damaged = true});
  int messages = 0;
  for (McapMessage message; reader.next(message);) ++messages;
  EXPECT_EQ(messages, 2);
  EXPECT_EQ(reader.damages().size(), 2U);
}

TEST(McapOfOthers, NumbersAreNotUsedTwice) {
  const ScratchDirectory scratch;
  ForeignFile file;
  put_channel(file.out(), 1, 0, {"/a", "cdr", {}, {}});
  put_channel(file.out(), 1, 0, {"/a", "cdr", {}, {}});
  put_channel(file.out(), 1, 0, {"/b", "cdr", {}, {}});
  file.end();
  file.save(scratch / "a.mcap");
  EXPECT_THAT(error_of([&] { read_mcap(scratch / "a.mcap"); }).what(),
              HasSubstr("is another of number 1"));
}

}  // namespace
}  // namespace striper::wire
