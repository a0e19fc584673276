// SPDX-License-Identifier: Apache-2.0
// Proves: a writer that is killed at any moment leaves a file that reads to its last whole chunk,
// of which at most 1 s is missing, and that can be repaired. Not what a computer without power
// leaves: that is the file system's.
#include <csignal>
#include <ctime>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <striper/wire/mcap_copy.hpp>

#include "support/mcap_files.hpp"
#include "support/scratch_directory.hpp"

namespace striper::wire {
namespace {

using striper::testing::read_mcap;
using striper::testing::ScratchDirectory;
using striper::testing::uniform;

std::uint64_t now_ns() {
  timespec time{};
  ::clock_gettime(CLOCK_MONOTONIC, &time);
  return static_cast<std::uint64_t>(time.tv_sec) * 1'000'000'000U +
         static_cast<std::uint64_t>(time.tv_nsec);
}

/// Writes for ever what the time is.
[[noreturn]] void write_until_killed(const std::filesystem::path& path) {
  McapWriter writer(path, {.compression = McapCompression::kNone, .chunk_bytes = 20'000});
  writer.add_channel(ros_channel("/a", schema_of<Odometer>()));
  std::vector<std::uint8_t> data(500, 7);
  for (std::uint32_t sequence = 0;; ++sequence) {
    const std::uint64_t now = now_ns();
    writer.write({0, sequence, now, now, data});
  }
}

TEST(KilledMcapWriter, LeavesAllButItsLastSecond) {
  const ScratchDirectory scratch;
  int with_messages = 0;
  for (int trial = 0; trial < 200; ++trial) {
    std::filesystem::remove(scratch / "a.mcap");
    const pid_t writer = ::fork();
    ASSERT_GE(writer, 0);
    if (writer == 0) write_until_killed(scratch / "a.mcap");
    ::usleep(static_cast<useconds_t>(uniform(0.0, 8000.0)));
    ::kill(writer, SIGKILL);
    ASSERT_EQ(::waitpid(writer, nullptr, 0), writer);
    const std::uint64_t killed = now_ns();
    if (!std::filesystem::exists(scratch / "a.mcap") ||
        std::filesystem::file_size(scratch / "a.mcap") < 42)
      continue;
    const auto read = read_mcap(scratch / "a.mcap");
    ASSERT_EQ(read.end, McapEnd::kCut);
    for (std::size_t i = 0; i < read.messages.size(); ++i) ASSERT_EQ(read.messages[i].sequence, i);
    if (read.messages.empty()) continue;
    ++with_messages;
    EXPECT_LT(killed - read.messages.back().log_time_ns, 1'000'000'000U);
    if (trial % 20 != 0) continue;
    EXPECT_EQ(copy_mcap(scratch / "a.mcap", scratch / "b.mcap").messages, read.messages.size());
    EXPECT_EQ(read_mcap(scratch / "b.mcap").messages, read.messages);
  }
  EXPECT_GT(with_messages, 20);
}

}  // namespace
}  // namespace striper::wire
