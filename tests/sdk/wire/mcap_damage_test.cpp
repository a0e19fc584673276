// SPDX-License-Identifier: Apache-2.0
// Proves: a file cut at any byte gives all of its whole chunks; no bit of a file can be flipped
// unnoticed; absurd lengths take no memory; what is damaged is repaired into a whole file with
// everything that is not.
#include <algorithm>
#include <cstring>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/wire/mcap_copy.hpp>

#include "support/error_of.hpp"
#include "support/mcap_files.hpp"
#include "support/scratch_directory.hpp"
#include "wire/mcap_content.hpp"

namespace striper::wire {
namespace {

using striper::testing::error_of;
using striper::testing::KeptMessage;
using striper::testing::read_bytes;
using striper::testing::read_mcap;
using striper::testing::ScratchDirectory;
using striper::testing::write_bytes;
using striper::testing::write_mcap;
using ::testing::HasSubstr;

const McapWriterOptions kSmall{.compression = McapCompression::kNone, .chunk_bytes = 400};

/// Where each record of a file begins, and its kind.
std::vector<std::pair<std::size_t, Opcode>> records_of(const std::string& bytes) {
  std::vector<std::pair<std::size_t, Opcode>> records;
  for (std::size_t at = kMcapMagic.size(); at + kRecordHeaderBytes <= bytes.size();) {
    std::uint64_t length = 0;
    std::memcpy(&length, bytes.data() + at + 1, sizeof length);
    records.emplace_back(at, static_cast<Opcode>(bytes[at]));
    if (records.back().second == Opcode::kFooter) break;
    at += kRecordHeaderBytes + length;
  }
  return records;
}

TEST(CutMcap, GivesItsWholeChunksWhereverItIsCut) {
  const ScratchDirectory scratch;
  const auto written = write_mcap(scratch / "a.mcap", 20, 120, kSmall);
  const std::string bytes = read_bytes(scratch / "a.mcap");
  const auto records = records_of(bytes);
  const std::size_t begin = records[1].first;  // Behind the header.
  std::size_t before = written.size();
  write_bytes(scratch / "cut.mcap", bytes);
  for (std::size_t size = bytes.size() - 1; size >= begin; --size) {
    std::filesystem::resize_file(scratch / "cut.mcap", size);
    const auto read = read_mcap(scratch / "cut.mcap");
    ASSERT_EQ(read.end, McapEnd::kCut) << size;
    ASSERT_LE(read.messages.size(), before) << size;
    ASSERT_TRUE(std::equal(read.messages.begin(), read.messages.end(), written.begin())) << size;
    before = read.messages.size();
  }
  EXPECT_EQ(before, 0U);
}

TEST(CutMcap, LosesNothingOfAChunkThatIsThere) {
  const ScratchDirectory scratch;
  const auto written = write_mcap(scratch / "a.mcap", 30, 120, kSmall);
  const std::string bytes = read_bytes(scratch / "a.mcap");
  const auto records = records_of(bytes);
  std::size_t last = 0;
  std::size_t chunks = 0;
  for (std::size_t i = 0; i + 1 < records.size(); ++i) {
    if (records[i].second != Opcode::kChunk) continue;
    write_bytes(scratch / "cut.mcap", bytes.substr(0, records[i + 1].first));
    const std::size_t messages = read_mcap(scratch / "cut.mcap").messages.size();
    EXPECT_GT(messages, last);
    write_bytes(scratch / "cut.mcap", bytes.substr(0, records[i + 1].first - 1));
    EXPECT_EQ(read_mcap(scratch / "cut.mcap").messages.size(), last);
    last = messages;
    ++chunks;
  }
  EXPECT_GT(chunks, 5U);
  EXPECT_EQ(last, written.size());
}

TEST(CutMcap, WithinItsHeaderIsNoMcapFile) {
  const ScratchDirectory scratch;
  write_mcap(scratch / "a.mcap", 1, 10);
  const std::string bytes = read_bytes(scratch / "a.mcap");
  for (std::size_t size = 0; size < records_of(bytes)[1].first; ++size) {
    write_bytes(scratch / "cut.mcap", bytes.substr(0, size));
    const Error error = error_of([&] { read_mcap(scratch / "cut.mcap"); });
    EXPECT_EQ(error.kind(), ErrorKind::kBadFile);
    EXPECT_THAT(error.what(), HasSubstr("cut.mcap: "));
  }
}

// A file is refused, or said to be cut, or what is read of it is what was written: never anything
// else.
TEST(DamagedMcap, NoBitIsFlippedUnnoticed) {
  const ScratchDirectory scratch;
  const auto written = write_mcap(scratch / "a.mcap", 6, 60, kSmall);
  const std::string bytes = read_bytes(scratch / "a.mcap");
  std::size_t refused = 0;
  std::size_t cut = 0;
  write_bytes(scratch / "b.mcap", bytes);
  std::fstream file(scratch / "b.mcap", std::ios::binary | std::ios::in | std::ios::out);
  const auto put = [&](std::size_t at, char byte) {
    file.seekp(static_cast<std::streamoff>(at));
    file.put(byte);
    file.flush();
  };
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    put(at, static_cast<char>(bytes[at] ^ (1 << at % 8)));
    try {
      const auto read = read_mcap(scratch / "b.mcap");
      ASSERT_EQ(read.end, McapEnd::kCut) << "bit " << at % 8 << " of byte " << at;
      ++cut;
    } catch (const Error& error) {
      ASSERT_THAT(error.what(), HasSubstr("b.mcap"));
      ASSERT_TRUE(error.kind() == ErrorKind::kBadFile || error.kind() == ErrorKind::kUnsupported)
          << error.what();
      ++refused;
    }
    put(at, bytes[at]);
  }
  // Only the magic at the end says that a file is whole.
  EXPECT_EQ(cut, kMcapMagic.size());
  EXPECT_EQ(refused + cut, bytes.size());
}

TEST(DamagedMcap, AbsurdLengthsAreRefused) {
  const ScratchDirectory scratch;
  write_mcap(scratch / "a.mcap", 30, 120, kSmall);
  const std::string bytes = read_bytes(scratch / "a.mcap");
  for (const auto& [offset, opcode] : records_of(bytes)) {
    for (const std::uint64_t length :
         {std::uint64_t{1} << 30, std::uint64_t{1} << 62, ~std::uint64_t{0}, ~std::uint64_t{8}}) {
      std::string damaged = bytes;
      std::memcpy(damaged.data() + offset + 1, &length, sizeof length);
      write_bytes(scratch / "b.mcap", damaged);
      EXPECT_EQ(error_of([&] { read_mcap(scratch / "b.mcap"); }).kind(), ErrorKind::kBadFile);
    }
  }
}

TEST(DamagedMcap, AChunkThatSaysItIsEnormousTakesNoMemory) {
  const ScratchDirectory scratch;
  write_mcap(scratch / "a.mcap", 30, 120);
  std::string bytes = read_bytes(scratch / "a.mcap");
  for (const auto& [offset, opcode] : records_of(bytes)) {
    if (opcode != Opcode::kChunk) continue;
    const std::uint64_t unpacked = std::uint64_t{300} << 20;
    std::memcpy(bytes.data() + offset + kRecordHeaderBytes + 16, &unpacked, sizeof unpacked);
  }
  write_bytes(scratch / "b.mcap", bytes);
  EXPECT_THAT(error_of([&] { read_mcap(scratch / "b.mcap"); }).what(),
              HasSubstr("has 314572800 bytes unpacked; at most 268435456 are read"));
}

TEST(DamagedMcap, FilesOfOtherKindsAreNone) {
  const ScratchDirectory scratch;
  for (const std::string& bytes :
       {std::string(), std::string("\x89PNG\r\n\x1a\n"), std::string("frame,time_s,laser\n"),
        std::string("#ROSBAG V2.0\n"), std::string(100, '\0')}) {
    write_bytes(scratch / "a.mcap", bytes);
    EXPECT_THAT(error_of([&] { McapReader(scratch / "a.mcap"); }).what(),
                HasSubstr("does not begin as an MCAP file"));
  }
}

TEST(RepairMcap, GivesAWholeFileOfACutOne) {
  const ScratchDirectory scratch;
  const auto written = write_mcap(scratch / "a.mcap", 60, 120, kSmall);
  const std::string bytes = read_bytes(scratch / "a.mcap");
  write_bytes(scratch / "cut.mcap", bytes.substr(0, bytes.size() / 2));
  const McapCopied repaired = copy_mcap(scratch / "cut.mcap", scratch / "b.mcap");
  EXPECT_TRUE(repaired.was_cut);
  EXPECT_EQ(repaired.attachments, 1U);
  EXPECT_EQ(repaired.metadata, 1U);
  ASSERT_EQ(repaired.damages.size(), 1U);
  EXPECT_LE(repaired.damages[0].offset + repaired.damages[0].bytes, bytes.size() / 2);
  const auto read = read_mcap(scratch / "b.mcap");
  EXPECT_EQ(read.end, McapEnd::kWhole);
  EXPECT_GT(read.messages.size(), 10U);
  EXPECT_EQ(read.messages.size(), repaired.messages);
  EXPECT_EQ(McapReader(scratch / "b.mcap").statistics()->messages, repaired.messages);
  EXPECT_TRUE(std::equal(read.messages.begin(), read.messages.end(), written.begin()));
}

TEST(RepairMcap, LeavesOutADamagedChunkAlone) {
  const ScratchDirectory scratch;
  const auto written = write_mcap(scratch / "a.mcap", 60, 120, kSmall);
  std::string bytes = read_bytes(scratch / "a.mcap");
  std::vector<std::size_t> chunks;
  for (const auto& [offset, opcode] : records_of(bytes)) {
    if (opcode == Opcode::kChunk) chunks.push_back(offset);
  }
  bytes[chunks[3] + 100] ^= 1;
  write_bytes(scratch / "b.mcap", bytes);
  const McapCopied repaired = copy_mcap(scratch / "b.mcap", scratch / "c.mcap");
  ASSERT_EQ(repaired.damages.size(), 1U);
  EXPECT_EQ(repaired.damages[0].offset, chunks[3]);
  EXPECT_GT(repaired.damages[0].bytes, 100U);
  EXPECT_LE(repaired.damages[0].bytes, chunks[4] - chunks[3]);
  EXPECT_THAT(repaired.damages[0].reason, HasSubstr("b.mcap: the chunk at byte"));
  const auto read = read_mcap(scratch / "c.mcap");
  EXPECT_EQ(read.end, McapEnd::kWhole);
  EXPECT_GT(read.messages.size(), 40U);
  EXPECT_LT(read.messages.size(), 60U);
  for (const KeptMessage& message : read.messages) {
    EXPECT_NE(std::find(written.begin(), written.end(), message), written.end());
  }
}

TEST(RepairMcap, ARepairedFileStaysAsItIs) {
  const ScratchDirectory scratch;
  write_mcap(scratch / "a.mcap", 60, 120);
  copy_mcap(scratch / "a.mcap", scratch / "b.mcap");
  copy_mcap(scratch / "b.mcap", scratch / "c.mcap");
  EXPECT_EQ(read_bytes(scratch / "b.mcap"), read_bytes(scratch / "c.mcap"));
  EXPECT_EQ(error_of([&] { copy_mcap(scratch / "a.mcap", scratch / "a.mcap"); }).kind(),
            ErrorKind::kUsage);
}

TEST(RepairMcap, ADamagedSummaryIsMadeAnew) {
  const ScratchDirectory scratch;
  const auto written = write_mcap(scratch / "a.mcap", 60, 120);
  std::string bytes = read_bytes(scratch / "a.mcap");
  bytes[bytes.size() - 100] ^= 4;
  write_bytes(scratch / "b.mcap", bytes);
  EXPECT_THAT(error_of([&] { read_mcap(scratch / "b.mcap"); }).what(),
              HasSubstr("checksum of the summary"));
  EXPECT_EQ(copy_mcap(scratch / "b.mcap", scratch / "c.mcap").messages, written.size());
  EXPECT_EQ(read_mcap(scratch / "c.mcap").messages, written);
}

}  // namespace
}  // namespace striper::wire
