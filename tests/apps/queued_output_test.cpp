// SPDX-License-Identifier: Apache-2.0
// Proves that a truck is never held up by an output that stands still, and that what is lost is
// counted to the message; that a recorded run loses nothing; that an output's last words are those
// of a safe state however it ends; that what it throws comes out. Threads are told apart by the
// thread sanitizer, which runs this too. A pipe that nobody reads is end_to_end's.
#include "guide/queued_output.hpp"

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>

#include "guide/guidance_lines.hpp"

namespace striper::program {
namespace {

using namespace std::chrono_literals;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Le;

constexpr std::size_t kMostQueued = 4096;
// Of a call that does not wait, on a machine that has other things to do.
constexpr auto kNoWait = 500ms;

// What an output has heard. It may be told to stand still.
struct Ear {
  std::vector<double> heard_s;  // Read it once the output has ended.
  std::vector<bool> switched;   // Likewise.
  std::atomic<bool> is_finished = false;
  std::atomic<bool> stands_still = false;
  std::atomic<int> standing = 0;
  std::mt19937 random{7};
  bool is_moody = false;
  std::string throws_at_3;
};

class Listening : public GuidanceOutput {
 public:
  explicit Listening(std::shared_ptr<Ear> ear) : ear_(std::move(ear)) {}
  void lateral(const LateralLine& line) override {
    ++ear_->standing;
    while (ear_->stands_still) std::this_thread::sleep_for(1ms);
    --ear_->standing;
    if (ear_->is_moody && ear_->random() % 64 == 0) std::this_thread::sleep_for(1ms);
    if (!ear_->throws_at_3.empty() && ear_->heard_s.size() == 3) {
      throw Error(ErrorKind::kIo, ear_->throws_at_3);
    }
    ear_->heard_s.push_back(line.time_s);
  }
  void switch_gun(std::size_t /*gun*/, bool is_on, double /*time_s*/) override {
    ear_->switched.push_back(is_on);
  }
  void finish() override { ear_->is_finished = true; }
  Account account() const override { return {ear_->heard_s.size(), 0, "line", {}}; }

 private:
  std::shared_ptr<Ear> ear_;
};

QueuedOutput::Open opening(const std::shared_ptr<Ear>& ear) {
  return [ear] { return std::make_unique<Listening>(ear); };
}

LateralLine line_at(double time_s) {
  LateralLine line;
  line.time_s = time_s;
  return line;
}

// The longest that a call took.
std::chrono::nanoseconds tell(QueuedOutput& output, int from, int to) {
  std::chrono::nanoseconds longest{0};
  for (int i = from; i < to; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    output.lateral(line_at(i));
    longest = std::max<std::chrono::nanoseconds>(longest, std::chrono::steady_clock::now() - begin);
  }
  return longest;
}

TEST(QueuedOutput, ATruckIsNotHeldUpAndWhatIsLostIsCounted) {
  const auto ear = std::make_shared<Ear>();
  ear->stands_still = true;
  QueuedOutput output("it", opening(ear), QueuedOutput::WhenFull::kDrop);
  output.lateral(line_at(0));
  while (ear->standing == 0) std::this_thread::sleep_for(1ms);  // The first is in its hand.
  EXPECT_LT(tell(output, 1, 10001), kNoWait);
  EXPECT_EQ(output.account().lost, 10000 - kMostQueued);
  ear->stands_still = false;
  output.finish();
  EXPECT_TRUE(ear->is_finished);
  EXPECT_EQ(output.account().lost, 10000 - kMostQueued);
  EXPECT_EQ(output.account().sent, 1 + kMostQueued);
  ASSERT_EQ(ear->heard_s.size(), 1 + kMostQueued);
  EXPECT_EQ(ear->heard_s.back(), kMostQueued);  // The oldest are kept, in their order.
}

TEST(QueuedOutput, AReaderThatComesBackHearsThatAGunIsOff) {
  const auto ear = std::make_shared<Ear>();
  ear->stands_still = true;
  QueuedOutput output("it", opening(ear), QueuedOutput::WhenFull::kDrop);
  tell(output, 0, 1);
  while (ear->standing == 0) std::this_thread::sleep_for(1ms);
  output.switch_gun(0, true, 1.0);
  tell(output, 1, 10000);
  output.switch_gun(0, false, 2.0);
  ear->stands_still = false;
  output.finish();
  EXPECT_EQ(ear->switched, (std::vector<bool>{true, false}));
}

TEST(QueuedOutput, OneThatNeverMovesIsLeftBehindWithinAFifthOfASecond) {
  const auto ear = std::make_shared<Ear>();
  ear->stands_still = true;
  {
    QueuedOutput output("it", opening(ear), QueuedOutput::WhenFull::kDrop);
    tell(output, 0, 1);
    while (ear->standing == 0) std::this_thread::sleep_for(1ms);
    tell(output, 1, 100);
    const auto begin = std::chrono::steady_clock::now();
    output.finish();
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 200ms + kNoWait);
    EXPECT_EQ(output.account().lost, 99U + 1U);  // And the one that says that all is safe.
    EXPECT_EQ(output.account().why, "nobody reads them");
    EXPECT_FALSE(ear->is_finished);
  }
  ear->stands_still = false;  // Its thread goes on with what is its own.
  while (!ear->is_finished) std::this_thread::sleep_for(1ms);
}

TEST(QueuedOutput, ARecordedRunLosesNothing) {
  const auto ear = std::make_shared<Ear>();
  ear->is_moody = true;
  QueuedOutput output("it", opening(ear), QueuedOutput::WhenFull::kWait);
  tell(output, 0, 20000);
  output.finish();
  EXPECT_EQ(output.account().lost, 0U);
  ASSERT_EQ(ear->heard_s.size(), 20000U);
  for (int i = 0; i < 20000; ++i) ASSERT_EQ(ear->heard_s[static_cast<std::size_t>(i)], i);
}

TEST(QueuedOutput, WhatIsHeardAndWhatIsLostComesToWhatWasTold) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    const auto ear = std::make_shared<Ear>();
    ear->random.seed(seed);
    ear->is_moody = true;
    std::mt19937 random(100 + seed);
    QueuedOutput output("it", opening(ear), QueuedOutput::WhenFull::kDrop);
    int told = 0;
    for (int burst = 0; burst < 12; ++burst) {
      const int more = static_cast<int>(random() % 2000);
      tell(output, told, told + more);
      told += more;
      std::this_thread::sleep_for(std::chrono::milliseconds(random() % 4));
    }
    output.finish();
    if (!ear->is_finished) continue;  // It was left behind: counted, see above.
    EXPECT_EQ(ear->heard_s.size() + output.account().lost, static_cast<std::size_t>(told)) << seed;
    EXPECT_TRUE(std::is_sorted(ear->heard_s.begin(), ear->heard_s.end())) << seed;
  }
}

std::string error_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST(QueuedOutput, WhatOpeningThrowsComesOut) {
  const auto fails = []() -> std::unique_ptr<GuidanceOutput> {
    throw Error(ErrorKind::kIo, "no such place");
  };
  for (const auto when : {QueuedOutput::WhenFull::kWait, QueuedOutput::WhenFull::kDrop}) {
    EXPECT_EQ(error_of([&] { QueuedOutput("it", fails, when); }), "no such place");
  }
}

TEST(QueuedOutput, WhatItThrowsComesOutOfARecordedRunAtOnceAndOfATruckAtItsEnd) {
  const auto ear = std::make_shared<Ear>();
  ear->throws_at_3 = "the disk is full";
  QueuedOutput recorded("it", opening(ear), QueuedOutput::WhenFull::kWait);
  EXPECT_EQ(error_of([&] {
              for (int i = 0; i < 100000; ++i) recorded.lateral(line_at(i));
            }),
            "the disk is full");

  const auto other = std::make_shared<Ear>();
  other->throws_at_3 = "the disk is full";
  QueuedOutput live("it", opening(other), QueuedOutput::WhenFull::kDrop);
  EXPECT_EQ(error_of([&] { tell(live, 0, 10000); }), "");
  EXPECT_EQ(error_of([&] { live.finish(); }), "the disk is full");
}

class OfLines : public ::testing::Test {
 protected:
  OfLines() {
    config_.guns.resize(2);
    config_.guns[0].name = "left";
    config_.guns[1].name = "right";
    config_.output.volts_safe = 1.5;
  }
  void TearDown() override { std::filesystem::remove(path_); }

  QueuedOutput::Open open() const {
    return [config = config_, path = path_.string()] {
      return std::make_unique<GuidanceLines>(config, path);
    };
  }
  std::vector<std::string> lines() const {
    std::ifstream file(path_);
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
  }

  GuidanceConfig config_;
  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() /
      (std::string("striper-queued-") +
       ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".jsonl");
};

TEST_F(OfLines, TheLastWordsAreThatAllIsSafeAlsoWhereNobodyEndsIt) {
  {
    QueuedOutput output("it", open(), QueuedOutput::WhenFull::kDrop);
    output.switch_gun(0, true, 1.0);
    output.switch_gun(1, true, 2.0);
    output.switch_gun(0, false, 3.0);
  }  // As where an error breaks a run off.
  const auto said = lines();
  ASSERT_EQ(said.size(), 5U);
  EXPECT_EQ(said[3], R"({"table":"switch","gun":"right","is_on":false,"time_s":3.0})");
  EXPECT_EQ(said[4], R"({"table":"safe","time_s":3.0,"volts":1.5})");
}

TEST_F(OfLines, AGunThatIsOffIsNotSwitchedOffAgain) {
  QueuedOutput output("it", open(), QueuedOutput::WhenFull::kWait);
  output.switch_gun(0, false, 1.0);
  output.switch_gun(0, true, 2.0);
  output.switch_gun(0, true, 3.0);
  output.switch_gun(0, false, 4.0);
  output.switch_gun(0, false, 5.0);
  output.finish();
  EXPECT_EQ(lines().size(), 3U);  // On, off, safe.
  EXPECT_EQ(output.account().sent, 3U);
  EXPECT_EQ(std::string(output.account().unit), "line");
}

}  // namespace
}  // namespace striper::program
