// SPDX-License-Identifier: Apache-2.0
// Proves that every kind of event has a word of its own that reads back, that events are as severe
// as their kind unless they say otherwise, and that those of several threads reach their handler
// whole and one at a time.
#include <atomic>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/event.hpp>

namespace striper {
namespace {

using ::testing::MatchesRegex;

TEST(EventCode, HasAWordOfItsOwnThatReadsBack) {
  std::set<std::string_view> words;
  for (const EventKind& kind : kEventKinds) {
    EXPECT_TRUE(words.insert(kind.word).second) << kind.word;
    EXPECT_THAT(std::string(kind.word), MatchesRegex("[a-z0-9_]+"));
    EXPECT_TRUE(kind.meaning.ends_with(".")) << kind.word;
    const std::optional<EventCode> code = EventCode::parse(kind.word);
    ASSERT_TRUE(code) << kind.word;
    EXPECT_EQ(code->word(), kind.word);
  }
  EXPECT_EQ(EventCode::parse("no_such_thing"), std::nullopt);
}

TEST(EventCode, KnowsTheWordsThatProgramsCountOn) {
  for (const char* word :
       {"source_lost", "source_back", "source_ended", "sink_slow", "sink_failed", "disk_full",
        "frames_dropped", "pattern_lost", "pattern_found", "no_stripe", "model_reloaded",
        "laser_off", "limit_broken", "drift", "seam", "cycle_incomplete"}) {
    EXPECT_TRUE(EventCode::parse(word)) << word;
  }
}

TEST(Event, IsAsSevereAsItsKindUnlessItSaysOtherwise) {
  EXPECT_EQ(Event("boards_parallel", "").severity, Severity::kRefusal);
  EXPECT_EQ(Event(Severity::kWarning, "boards_parallel", "").severity, Severity::kWarning);
}

TEST(Event, SeveritiesAreCalledAsInFiles) {
  EXPECT_EQ(to_string(Severity::kInfo), "info");
  EXPECT_EQ(to_string(Severity::kWarning), "warning");
  EXPECT_EQ(to_string(Severity::kError), "error");
  EXPECT_EQ(to_string(Severity::kRefusal), "refusal");
}

TEST(Event, SeveralAreAsBadAsTheWorstWhereverItIs) {
  EXPECT_EQ(worst(std::vector<Event>{}), Severity::kInfo);
  for (const Severity bad : {Severity::kInfo, Severity::kWarning, Severity::kRefusal}) {
    for (std::size_t at = 0; at < 4; ++at) {
      std::vector<Event> events(4);
      events[at].severity = bad;
      EXPECT_EQ(worst(events), bad) << at;
    }
  }
}

TEST(EventPort, WithoutAHandlerIsSilent) { EventPort().send({"source_lost", "nobody listens"}); }

TEST(EventPort, GivesItsHandlerTheEventAndTheTime) {
  std::vector<Event> heard;
  const EventPort port([&](const Event& event) { heard.push_back(event); });
  port.of_head("left").send({"source_lost", "the cable", "plug it in"});
  ASSERT_EQ(heard.size(), 1U);
  EXPECT_EQ(heard[0].code, EventCode("source_lost"));
  EXPECT_EQ(heard[0].message, "the cable");
  EXPECT_EQ(heard[0].advice, "plug it in");
  EXPECT_EQ(heard[0].head, "left");
  EXPECT_GT(heard[0].time_s, 1.7e9);
}

TEST(EventPort, AHandlerThatThrowsHarmsNobody) {
  int calls = 0;
  const EventPort port([&](const Event&) {
    if (++calls == 1) throw std::runtime_error("once");
  });
  port.send({"source_lost", ""});
  port.send({"source_back", ""});
  EXPECT_EQ(calls, 2);
}

TEST(EventPort, EventsOfSeveralThreadsComeOneAtATime) {
  constexpr int kThreads = 4;
  constexpr int kEvents = 500;
  std::atomic<int> inside = 0;
  int heard = 0;
  const EventPort port([&](const Event& event) {
    EXPECT_EQ(++inside, 1);
    EXPECT_EQ(event.message, "all of it");
    ++heard;
    --inside;
  });
  std::vector<std::thread> threads;
  threads.reserve(kThreads);
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([&port] {
      for (int k = 0; k < kEvents; ++k) port.send({"frames_dropped", "all of it"});
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(heard, kThreads * kEvents);
}

}  // namespace
}  // namespace striper
