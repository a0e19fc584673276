// SPDX-License-Identifier: Apache-2.0
// Proves what is taken of an odometer's serial line: its readings, and nothing else: no part of a
// number, no line that was cut, too long or glued to another; against a naive reading of random
// text; through a pseudo terminal, which goes away too.
#include "guide/live/odometer_lines.hpp"

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <random>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <striper/core/error.hpp>

#include "guide/live/odometer_port.hpp"

namespace striper::program {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<OdometerReading> readings_of(OdometerLines& lines, std::string_view text) {
  std::vector<OdometerReading> readings;
  for (const char byte : text) {
    if (const auto reading = lines.take(byte)) readings.push_back(*reading);
  }
  return readings;
}

std::vector<std::int64_t> counts_of(std::string_view text) {
  OdometerLines lines;
  std::vector<std::int64_t> counts;
  for (const OdometerReading& one : readings_of(lines, text)) counts.push_back(one.counts);
  return counts;
}

TEST(OdometerLines, ALineIsAReading) {
  OdometerLines lines;
  const auto readings = readings_of(lines, "\n12\n-7\r\n4294967295,-0.25\r\n8 \n9,nan\n");
  ASSERT_EQ(readings.size(), 5U);
  EXPECT_EQ(readings[1].counts, -7);
  EXPECT_TRUE(std::isnan(readings[1].yaw_rate_rad_s));
  EXPECT_EQ(readings[2].counts, 4294967295);
  EXPECT_EQ(readings[2].yaw_rate_rad_s, -0.25);
  EXPECT_TRUE(std::isnan(readings[4].yaw_rate_rad_s));
}

TEST(OdometerLines, TheFirstLineMayHaveBegunBefore) {
  EXPECT_THAT(counts_of("456\n123457\n"), ElementsAre(123457));
}

TEST(OdometerLines, WhatWasHeardBeforeALineWasOpenedAgainIsNoPartOfANumber) {
  OdometerLines lines;
  EXPECT_EQ(readings_of(lines, "\n100\n12").size(), 1U);
  lines.begin_anew();
  const auto after = readings_of(lines, "34\n1235\n");
  ASSERT_EQ(after.size(), 1U);
  EXPECT_EQ(after[0].counts, 1235);
}

TEST(OdometerLines, WhatIsNoNumberIsLeftOut) {
  EXPECT_THAT(counts_of("\n\n \nx\n1x\n1,\n1,x\n1 2\n1,2,3\n1;2\n+1\n1.5\n0x10\n1,inf\n1,1e999\n"
                        "99999999999999999999\n\xff\xfe\n7\n"),
              ElementsAre(7));
}

TEST(OdometerLines, ALineThatIsTooLongIsNotItsBegin) {
  EXPECT_THAT(counts_of("\n5" + std::string(100, ' ') + "x\n6" + std::string(79, ' ') + "\n7" +
                        std::string(80, ' ') + "\n" + std::string(1000000, '9') + "\n8\n"),
              ElementsAre(6, 8));
}

// As the C library reads it.
std::optional<std::int64_t> naive(const std::string& line) {
  static const std::regex form(R"(-?[0-9]+(,-?([0-9]+\.?[0-9]*|\.[0-9]+)(e[-+]?[0-9]+)?)?[ \r]*)");
  if (line.size() > 80 || !std::regex_match(line, form)) return {};
  errno = 0;
  const long long counts = std::strtoll(line.c_str(), nullptr, 10);
  if (const auto comma = line.find(','); comma != std::string::npos) {
    std::strtod(line.c_str() + comma + 1, nullptr);
  }
  if (errno == ERANGE) return {};
  return counts;
}

TEST(OdometerLines, RandomTextIsReadAsANaiveReaderReadsIt) {
  constexpr std::string_view kBytes = "0123456789012345678901234567890123456789,,.-+e \r\n\n\n\n\n";
  std::mt19937 random(11);
  std::string text = "\n";
  for (int i = 0; i < 400000; ++i) text += kBytes[random() % kBytes.size()];
  std::vector<std::int64_t> expected;
  std::size_t from = 1;
  for (std::size_t end; (end = text.find('\n', from)) != std::string::npos; from = end + 1) {
    if (const auto counts = naive(text.substr(from, end - from))) expected.push_back(*counts);
  }
  EXPECT_GT(expected.size(), 1000U);
  EXPECT_EQ(counts_of(text), expected);
}

// The far end of a serial line.
class SerialLine : public ::testing::Test {
 protected:
  SerialLine() : host_(::posix_openpt(O_RDWR | O_NOCTTY)) {
    ::grantpt(host_);
    ::unlockpt(host_);
    device_ = ::ptsname(host_);
  }
  ~SerialLine() override { hang_up(); }
  void hang_up() {
    if (host_ >= 0) ::close(host_);
    host_ = -1;
  }
  void write(const std::string& text) const {
    ASSERT_EQ(::write(host_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  std::unique_ptr<OdometerPort> open() {
    return open_odometer_port("serial:" + device_ + "?baud=115200", 32, EventPort(),
                              [this](const LiveInput& input) {
                                const std::lock_guard lock(mutex_);
                                counts_.push_back(std::get<OdometerReading>(input).counts);
                              });
  }
  std::vector<std::int64_t> wait_for(std::size_t number) {
    for (int i = 0; i < 500; ++i) {
      {
        const std::lock_guard lock(mutex_);
        if (counts_.size() >= number) return counts_;
      }
      std::this_thread::sleep_for(10ms);
    }
    return {};
  }

  int host_;
  std::string device_;
  std::mutex mutex_;
  std::vector<std::int64_t> counts_;
};

TEST_F(SerialLine, IsReadHoweverItsBytesCome) {
  const auto port = open();
  write("77\n1");
  std::this_thread::sleep_for(30ms);
  write("00\r");
  std::this_thread::sleep_for(30ms);
  write("\n101\r\n1");
  write("02\n");
  EXPECT_THAT(wait_for(3), ElementsAre(100, 101, 102));
}

TEST_F(SerialLine, OneThatIsSilentOrGoneEndsAtOnce) {
  for (const bool is_gone : {false, true}) {
    auto port = open();
    if (is_gone) {
      hang_up();
      std::this_thread::sleep_for(150ms);  // It waits to open it again.
    }
    const auto begin = std::chrono::steady_clock::now();
    port.reset();
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 400ms);
  }
}

std::string refusal_of(const std::string& address) {
  try {
    open_odometer_port(address, 32, EventPort(), [](const LiveInput&) {});
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST_F(SerialLine, AnAddressThatCannotBeIsSaid) {
  // It would wrap every 106 m, and be taken for a counter that jumps.
  EXPECT_THAT(
      refusal_of("can:can0?id=816&start=0&size=12"),
      ::testing::AnyOf(HasSubstr("size=12 - expected 32 or more"), HasSubstr("built without CAN")));
  EXPECT_THAT(refusal_of("serial:/dev/there-is-none"), HasSubstr("/dev/there-is-none"));
  for (const char* baud : {"fast", "9601", "9600x", "", "-9600"}) {
    const std::string address = "serial:" + device_ + "?baud=" + baud;
    EXPECT_THAT(refusal_of(address), HasSubstr(address));
    EXPECT_THAT(refusal_of(address), HasSubstr("expected baud=9600"));
  }
  EXPECT_THAT(refusal_of("wheel:1"), HasSubstr("expected encoder, serial:DEVICE"));
}

}  // namespace
}  // namespace striper::program
