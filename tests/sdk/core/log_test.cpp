// SPDX-License-Identifier: Apache-2.0
// Proves that the library is silent until it is given a callback, and that messages of several
// threads reach it whole and one at a time.
#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/log.hpp>

namespace striper {
namespace {

TEST(Log, WithoutACallbackNothingHappens) {
  set_log_callback({});
  log(LogLevel::kError, "nobody listens");
}

TEST(Log, CallbackGetsLevelAndMessageUntilItIsTakenAway) {
  std::vector<std::string> heard;
  set_log_callback([&](LogLevel level, std::string_view message) {
    EXPECT_EQ(level, LogLevel::kWarning);
    heard.emplace_back(message);
  });
  log(LogLevel::kWarning, "one");
  set_log_callback({});
  log(LogLevel::kWarning, "two");
  EXPECT_EQ(heard, std::vector<std::string>{"one"});
}

TEST(Log, MessagesOfSeveralThreadsComeOneAtATime) {
  constexpr int kThreads = 4;
  constexpr int kMessages = 500;
  std::atomic<int> inside = 0;
  int heard = 0;
  set_log_callback([&](LogLevel, std::string_view message) {
    EXPECT_EQ(++inside, 1);
    EXPECT_EQ(message, "all of it");
    ++heard;
    --inside;
  });
  std::vector<std::thread> threads;
  threads.reserve(kThreads);
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([] {
      for (int k = 0; k < kMessages; ++k) log(LogLevel::kInfo, "all of it");
    });
  }
  for (std::thread& thread : threads) thread.join();
  set_log_callback({});
  EXPECT_EQ(heard, kThreads * kMessages);
}

}  // namespace
}  // namespace striper
