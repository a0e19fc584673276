// SPDX-License-Identifier: Apache-2.0
// Proves: a recording with rotation is in several files that together hold every message in order,
// each no larger and no longer than asked for, each with all channels and extras.
#include <gtest/gtest.h>

#include <striper/wire/mcap_series.hpp>

#include "support/error_of.hpp"
#include "support/mcap_files.hpp"
#include "support/scratch_directory.hpp"

namespace striper::wire {
namespace {

using striper::testing::error_of;
using striper::testing::read_mcap;
using striper::testing::ScratchDirectory;

TEST(McapRotation, ReadsSizesAndTimes) {
  EXPECT_EQ(McapRotation::parse("1GB").bytes, 1'000'000'000U);
  EXPECT_EQ(McapRotation::parse("500kB").bytes, 500'000U);
  EXPECT_EQ(McapRotation::parse("10min").ns, 600'000'000'000U);
  EXPECT_EQ(McapRotation::parse("90s").ns, 90'000'000'000U);
  EXPECT_EQ(McapRotation::parse("90s").bytes, 0U);
  for (const char* text : {"", "1", "GB", "0GB", "-1GB", "1.5GB", "1 GB", "1gb", "10minutes",
                           "99999999999999999999h", "1000000h"}) {
    EXPECT_EQ(error_of([&] { McapRotation::parse(text); }).kind(), ErrorKind::kUsage) << text;
  }
}

/// Writes 1 kB every 10 ms; returns how many messages each file has.
std::vector<std::size_t> rotate(const ScratchDirectory& scratch, McapRotation rotation,
                                std::uint32_t count) {
  McapSeries series(scratch / "run.mcap", rotation,
                    {.compression = McapCompression::kNone, .chunk_ns = 50'000'000});
  series.attach({"head/striper.yaml", "application/yaml", 0, 0, "striper_model: 1\n"});
  series.add_metadata({"striper", {}});
  series.add_channel(ros_channel("/a", schema_of<Event>()));
  series.add_channel(ros_channel("/b", schema_of<Odometer>()));
  const std::vector<std::uint8_t> data(1000);
  for (std::uint32_t i = 0; i < count; ++i)
    series.write({static_cast<std::uint16_t>(i % 2), i, 10'000'000U * i, 0, data});
  series.close();
  std::vector<std::size_t> messages;
  std::uint32_t next = 0;
  for (const auto& path : series.paths()) {
    const auto read = read_mcap(path);
    EXPECT_EQ(McapReader(path).attachments().size(), 1U);
    EXPECT_EQ(McapReader(path).metadata().size(), 1U);
    messages.push_back(read.messages.size());
    for (const auto& message : read.messages) {
      EXPECT_EQ(message.sequence, next);
      EXPECT_EQ(message.topic, next % 2 == 0 ? "/a" : "/b");
      ++next;
    }
  }
  EXPECT_EQ(next, count);
  return messages;
}

TEST(McapSeries, BySizeGivesFilesThatAreNoLarger) {
  const ScratchDirectory scratch;
  EXPECT_GT(rotate(scratch, {.bytes = 20'000}, 100).size(), 5U);
  EXPECT_TRUE(std::filesystem::exists(scratch / "run_0000.mcap"));
  EXPECT_TRUE(std::filesystem::exists(scratch / "run_0005.mcap"));
  EXPECT_FALSE(std::filesystem::exists(scratch / "run.mcap"));
  // The summary comes on top.
  EXPECT_LT(std::filesystem::file_size(scratch / "run_0000.mcap"), 26'000U);
}

TEST(McapSeries, ByTimeGivesFilesThatAreAsLong) {
  const ScratchDirectory scratch;
  EXPECT_EQ(rotate(scratch, {.ns = 400'000'000}, 100), (std::vector<std::size_t>{40, 40, 20}));
}

TEST(McapSeries, WithoutRotationIsOneFile) {
  const ScratchDirectory scratch;
  EXPECT_EQ(rotate(scratch, {}, 100), (std::vector<std::size_t>{100}));
  EXPECT_TRUE(std::filesystem::exists(scratch / "run.mcap"));
}

}  // namespace
}  // namespace striper::wire
