// SPDX-License-Identifier: Apache-2.0
// Proves what is read from a truck's frames: ours as data/can/guidance.dbc has them, a counter
// anywhere in somebody else's (both orders of bytes, against the naive reading of the DBC's words),
// what says that it is not known, what is too short; lines of a log, a log that is played at its
// pace; random lines and places of a counter, which are read or refused. A bus is vcan.sh's.
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <striper/can/truck_frames.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

HeardFrame heard_of(std::uint32_t id, std::initializer_list<int> bytes) {
  HeardFrame heard{12.5, {}};
  heard.frame.id = id;
  for (const int byte : bytes) {
    heard.frame.data[heard.frame.size++] = static_cast<std::uint8_t>(byte);
  }
  return heard;
}

OdometerReading reading_of(const std::optional<TruckWord>& word) {
  return std::get<OdometerReading>(word.value());
}
TruckState state_of(const std::optional<TruckWord>& word) {
  return std::get<TruckState>(word.value());
}

TEST(TruckFrames, AnOdometerIsCountsAndAYawRateWhereThereIsOne) {
  const TruckFrames frames;
  const auto full = reading_of(frames.read(heard_of(816, {0x78, 0x56, 0x34, 0xF2, 0x9C, 0xFF})));
  EXPECT_EQ(full.time_s, 12.5);
  EXPECT_EQ(full.counts, 0xF2345678);
  EXPECT_NEAR(full.yaw_rate_rad_s, -0.01, 1e-12);
  EXPECT_TRUE(std::isnan(reading_of(frames.read(heard_of(816, {1, 0, 0, 0}))).yaw_rate_rad_s));
  EXPECT_TRUE(
      std::isnan(reading_of(frames.read(heard_of(816, {1, 0, 0, 0, 0x00, 0x80}))).yaw_rate_rad_s));
}

TEST(TruckFrames, AStateIsTheLaserAndTheMirror) {
  const TruckFrames frames;
  const TruckState on = state_of(frames.read(heard_of(817, {1, 0x98, 0x08})));
  EXPECT_EQ(on.laser, 1);
  EXPECT_NEAR(on.mirror_hz, 22.0, 1e-9);
  const TruckState off = state_of(frames.read(heard_of(817, {0, 0xFF, 0xFF})));
  EXPECT_EQ(off.laser, 0);
  EXPECT_TRUE(std::isnan(off.mirror_hz));
  EXPECT_EQ(state_of(frames.read(heard_of(817, {3, 0, 0}))).laser, 1);
  EXPECT_EQ(state_of(frames.read(heard_of(817, {3, 0, 0}))).mirror_hz, 0.0);
}

TEST(TruckFrames, WhatIsAnotherFrameOrTooShortIsNothing) {
  const TruckFrames frames;
  EXPECT_FALSE(frames.read(heard_of(815, {0, 0, 0, 0, 0, 0})).has_value());
  EXPECT_FALSE(frames.read(heard_of(816, {0, 0, 0})).has_value());
  EXPECT_FALSE(frames.read(heard_of(817, {1, 0})).has_value());
  EXPECT_THAT(TruckFrames(100).ids(), ElementsAre(100, 101));
}

TEST(TruckFrames, ACounterStandsAnywhereInEitherOrder) {
  // 0x0123456789ABCDEF: each nibble is where it is.
  const HeardFrame heard = heard_of(0x18FEE000, {0x01, 0x23, 0x45, 0x67, 0x89, 0xAB, 0xCD, 0xEF});
  const auto counts = [&](const char* query) {
    CanUri uri = CanUri::parse(std::string("can:can0?id=0x18FEE000&") + query);
    return reading_of(TruckFrames::of(uri).read(heard)).counts;
  };
  EXPECT_EQ(counts("start=0&size=16"), 0x2301);
  EXPECT_EQ(counts("start=8&size=32&order=little"), 0x89674523);
  EXPECT_EQ(counts("start=4&size=8"), 0x30);
  // Big-endian: the highest bit of byte 1 is bit 15, its bytes follow.
  EXPECT_EQ(counts("start=15&size=16&order=big"), 0x2345);
  EXPECT_EQ(counts("start=7&size=32&order=big"), 0x01234567);
  EXPECT_EQ(counts("start=11&size=8&order=big"), 0x34);
  CanUri uri = CanUri::parse("can:can0?id=0x18FEE000&start=32&size=32");
  EXPECT_EQ(reading_of(TruckFrames::of(uri).read(heard)).counts, 0xEFCDAB89);
  HeardFrame cut = heard;
  cut.frame.size = 7;
  EXPECT_FALSE(TruckFrames(0x18FEE000, CanSignal{32, 32, false}).read(cut).has_value());
}

std::string refusal_of(const std::string& query) {
  try {
    CanUri uri = CanUri::parse("can:can0?" + query);
    open_can_listener(uri, TruckFrames::of(uri).ids());
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST(TruckFrames, AnAddressThatCannotBeIsSaid) {
  EXPECT_THAT(refusal_of("id=0x20000000"), HasSubstr("id=0x20000000"));
  EXPECT_THAT(refusal_of("id=twelve"), HasSubstr("expected an identifier"));
  EXPECT_THAT(refusal_of("start=40&size=32"), HasSubstr("within a frame's 64"));
  EXPECT_THAT(refusal_of("start=34&size=32&order=big"), HasSubstr("within a frame's 64"));
  EXPECT_THAT(refusal_of("order=middle"), HasSubstr("expected little or big"));
  EXPECT_THAT(refusal_of("nonsense=1"), HasSubstr("nonsense"));
}

TEST(ReadCandumpLine, TakesWhatCandumpWrites) {
  HeardFrame heard;
  ASSERT_TRUE(read_candump_line("(1700000000.250000) can0 330#78563412\r", heard));
  EXPECT_EQ(heard.time_s, 1700000000.25);
  EXPECT_EQ(heard.frame.id, 0x330U);
  EXPECT_EQ(heard.frame.size, 4);
  EXPECT_EQ(heard.frame.data[3], 0x12);
  ASSERT_TRUE(read_candump_line("(0.5) vcan0 18FEE000# R", heard));
  EXPECT_EQ(heard.frame.id, 0x18FEE000U);
  EXPECT_EQ(heard.frame.size, 0);
  for (const char* none :
       {"", "(1.0", "(1.0) can0", "(1.0) can0 330", "(x) can0 330#00", "(1.0) can0 330#0",
        "(1.0) can0 330#R", "(1.0) can0 330#001122334455667788", "(1.0) can0 330##100",
        "(1.0) can0 FFFFFFFF#00", "() can0 330#00", "(inf) can0 330#00", "(nan) can0 330#00",
        "(1e999) can0 330#00"}) {
    EXPECT_FALSE(read_candump_line(none, heard)) << none;
  }
}

// With few letters, so that whole lines come about, and with whole lines that are spoilt.
std::string random_line(std::mt19937& random) {
  constexpr std::string_view kBytes = "()#.0123456789ABCDEFR can";
  std::string line = "(17.25) can0 330#0102030405060708";
  const auto spoils = random() % 4;
  for (std::size_t i = 0; i < spoils; ++i) {
    const std::size_t at = random() % line.size();
    if (random() % 3 == 0) {
      line.erase(at, 1 + random() % 4);
    } else {
      line.insert(at, 1, kBytes[random() % kBytes.size()]);
    }
  }
  return line;
}

TEST(ReadCandumpLine, WhatItTakesIsThatFrameAgainAsALine) {
  std::mt19937 random(5);
  int taken = 0;
  for (int i = 0; i < 100000; ++i) {
    HeardFrame heard;
    const std::string line = random_line(random);
    if (!read_candump_line(line, heard)) continue;
    ++taken;
    ASSERT_TRUE(std::isfinite(heard.time_s)) << line;
    ASSERT_LE(heard.frame.size, heard.frame.data.size()) << line;
    ASSERT_LE(heard.frame.id, 0x1FFFFFFFU) << line;
    std::string again;
    append_candump_line(again, heard.time_s, heard.frame);
    again.pop_back();
    HeardFrame same;
    ASSERT_TRUE(read_candump_line(again, same)) << again;
    ASSERT_EQ(same.frame.id, heard.frame.id) << line;
    ASSERT_EQ(same.frame.size, heard.frame.size) << line;
    ASSERT_EQ(same.frame.data, heard.frame.data) << line;
    ASSERT_NEAR(same.time_s, heard.time_s, 1e-6 * std::max(1.0, std::abs(heard.time_s))) << line;
  }
  EXPECT_GT(taken, 10000);
}

TEST(TruckFrames, EachPlaceOfACounterIsReadOrRefusedWhateverTheFrame) {
  std::mt19937 random(6);
  int read = 0;
  for (int i = 0; i < 100000; ++i) {
    const CanSignal signal{static_cast<int>(random() % 70) - 3, static_cast<int>(random() % 36) - 1,
                           random() % 2 == 0};
    HeardFrame heard{1.0, {}};
    heard.frame.id = 7;
    heard.frame.size = static_cast<std::uint8_t>(random() % 9);
    for (auto& byte : heard.frame.data) byte = static_cast<std::uint8_t>(random());
    try {
      const auto word = TruckFrames(7, signal).read(heard);
      if (!word) continue;
      ++read;
      const auto counts = std::get<OdometerReading>(*word).counts;
      ASSERT_GE(counts, 0);
      ASSERT_LT(counts, std::int64_t{1} << signal.size);
    } catch (const Error& error) {
      ASSERT_EQ(error.kind(), ErrorKind::kBadValue);
    }
  }
  EXPECT_GT(read, 10000);
}

class LogFile : public ::testing::Test {
 protected:
  void write(const std::string& text) const { std::ofstream(path_) << text; }
  std::unique_ptr<CanListener> open() const {
    return open_can_listener(CanUri::parse("candump:" + path_.string()), {0x330, 0x331});
  }
  void TearDown() override { std::filesystem::remove(path_); }

  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() /
      (std::string("striper-can-") +
       ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".log");
};

TEST_F(LogFile, IsPlayedAtItsPaceAndThenIsOver) {
  write("(100.0) can0 330#01000000\n(100.1) can0 123#00\n\n(100.2) can0 331#01FFFF\n");
  const auto log = open();
  HeardFrame first;
  HeardFrame second;
  ASSERT_TRUE(log->next(first, 1s));
  EXPECT_FALSE(log->next(second, 10ms));
  EXPECT_FALSE(log->is_over());
  ASSERT_TRUE(log->next(second, 5s));
  EXPECT_EQ(second.frame.id, 0x331U);
  // Never early; how late is the machine's.
  EXPECT_GE(second.time_s - first.time_s, 0.19);
  EXPECT_GT(first.time_s, 1.7e9);
  EXPECT_TRUE(log->is_over());
  EXPECT_FALSE(log->next(second, 1ms));
}

TEST_F(LogFile, OneThatIsNoneIsSaidWithItsLine) {
  write("(100.0) can0 123#00\n  can0  330   [4]  01 00 00 00\n");
  try {
    open();
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr(".log:2: '  can0  330"));
    EXPECT_THAT(error.what(), HasSubstr("candump -L"));
  }
  std::filesystem::remove(path_);
  EXPECT_THROW(open(), Error);
}

// Whoever opened it would wait for a writer, and Ctrl-C would not end that.
TEST_F(LogFile, APipeIsRefused) {
  ASSERT_EQ(::mkfifo(path_.c_str(), 0600), 0);
  try {
    open();
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUnsupported);
    EXPECT_THAT(error.what(), HasSubstr("a bus is can:INTERFACE"));
  }
}

TEST_F(LogFile, TimesThatCannotBeDoNotHoldItUp) {
  write("(100.0) can0 330#01000000\n(50.0) can0 330#02000000\n(1e300) can0 330#03000000\n");
  const auto log = open();
  HeardFrame heard;
  ASSERT_TRUE(log->next(heard, 1s));
  ASSERT_TRUE(log->next(heard, 1s));  // Before the first: at once.
  EXPECT_FALSE(log->next(heard, 10ms));
}

}  // namespace
}  // namespace striper
