// SPDX-License-Identifier: Apache-2.0
// Proves what a bus promises of each of its sinks: all scans, or the newest, counted to the last;
// none held up by another, whatever that does. Under the thread sanitizer: no race.
#include <algorithm>
#include <chrono>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/stream/open_sink.hpp>
#include <striper/stream/scan_bus.hpp>

#include "support/allocation_counter.hpp"
#include "support/made_scans.hpp"
#include "support/scratch_directory.hpp"
#include "support/sinks.hpp"

namespace striper {
namespace {

using namespace std::chrono_literals;
using testing::Door;
using testing::made_scans;
using testing::SinkThat;

class Heard {
 public:
  EventPort port() {
    return EventPort([this](const Event& event) { events_.push_back(event); });
  }
  int count(EventCode code) const {
    return static_cast<int>(std::count_if(events_.begin(), events_.end(),
                                          [&](const Event& event) { return event.code == code; }));
  }

 private:
  std::vector<Event> events_;
};

HeadInfo live() {
  HeadInfo head;
  head.source.is_live = true;
  return head;
}

SinkNeeds newest() {
  SinkNeeds needs;
  needs.delivery = Delivery::kNewest;
  return needs;
}

BusOptions impatient() {
  BusOptions options;
  options.stuck_after = 100ms;
  options.live_hold = 50ms;
  return options;
}

// A stuck sink that was left behind may still be at its end when a test is.
void let_go(const Door& door) {
  door.open();
  std::this_thread::sleep_for(50ms);
}

TEST(ScanBus, EverySinkGetsEveryScanInOrder) {
  std::vector<std::uint64_t> seen[2];
  ScanBus bus;
  for (auto& of_one : seen) {
    bus.add("sink", std::make_unique<SinkThat>(
                        [&](const PolarScan& scan) { of_one.push_back(scan.sequence); }));
  }
  for (const auto& scan : made_scans(200)) bus.write(scan);
  bus.finish();
  for (const auto& of_one : seen) {
    ASSERT_EQ(of_one.size(), 200U);
    EXPECT_TRUE(std::is_sorted(of_one.begin(), of_one.end()));
  }
  for (const SinkReport& report : bus.sinks()) {
    EXPECT_EQ(report.written, 200U);
    EXPECT_EQ(report.lost, 0U);
    EXPECT_EQ(report.state, SinkReport::State::kFinished);
  }
}

// A recording that somebody asks for while a head runs.
TEST(ScanBus, SinksComeAndGoWhileScansFlow) {
  int opened = 0;
  std::vector<std::uint64_t> seen;
  class Late : public SinkThat {
   public:
    Late(int& opened, Action action) : SinkThat(std::move(action)), opened_(opened) {}
    void open(const HeadInfo& /*head*/) override { ++opened_; }

   private:
    int& opened_;
  };
  ScanBus bus;
  std::uint64_t kept = 0;
  bus.add("stays", std::make_unique<SinkThat>([&](const PolarScan&) { ++kept; }));
  bus.open({});
  const auto scans = made_scans(90);
  for (int i = 0; i < 30; ++i) bus.write(scans[static_cast<std::size_t>(i)]);
  bus.add("late", std::make_unique<Late>(
                      opened, [&](const PolarScan& scan) { seen.push_back(scan.sequence); }));
  for (int i = 30; i < 60; ++i) bus.write(scans[static_cast<std::size_t>(i)]);
  EXPECT_TRUE(bus.remove("nobody").empty());
  const auto reports = bus.remove("late");
  for (int i = 60; i < 90; ++i) bus.write(scans[static_cast<std::size_t>(i)]);
  bus.finish();
  EXPECT_EQ(opened, 1);
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_EQ(reports[0].state, SinkReport::State::kFinished);
  EXPECT_EQ(reports[0].written, 30U);
  ASSERT_EQ(seen.size(), 30U);
  EXPECT_EQ(seen.front(), scans[30]->sequence);
  EXPECT_EQ(kept, 90U);
  EXPECT_EQ(bus.sinks().size(), 1U);
}

TEST(ScanBus, SourceThatCanWaitWaitsForALosslessSink) {
  ScanBus bus;
  bus.add("slow",
          std::make_unique<SinkThat>([](const PolarScan&) { std::this_thread::sleep_for(1ms); }));
  bus.open({});
  for (const auto& scan : made_scans(150)) bus.write(scan);
  bus.finish();
  EXPECT_EQ(bus.sinks()[0].written, 150U);
  EXPECT_EQ(bus.sinks()[0].lost, 0U);
}

TEST(ScanBus, LiveScansAreDroppedOnceTheQueueIsOldAndCounted) {
  Heard heard;
  const Door door;
  BusOptions options = impatient();
  options.stuck_after = 10s;
  ScanBus bus(heard.port(), options);
  bus.add("slow", std::make_unique<SinkThat>([&](const PolarScan&) { door.wait(); }));
  bus.open(live());
  const auto scans = made_scans(3);
  for (int i = 0; i < 2; ++i) bus.write(scans[0]);
  std::this_thread::sleep_for(60ms);
  for (int i = 0; i < 5; ++i) bus.write(scans[1]);
  door.open();
  bus.finish();
  EXPECT_EQ(bus.sinks()[0].written, 2U);
  EXPECT_EQ(bus.sinks()[0].lost, 5U);
  EXPECT_EQ(heard.count("sink_slow"), 2);  // When it begins, and the sum.
}

TEST(ScanBus, NewestKeepsTheTwoThatCameLast) {
  Heard heard;
  const Door begun;
  const Door door;
  std::vector<std::uint64_t> seen;
  ScanBus bus(heard.port());
  bus.add("page", std::make_unique<SinkThat>(
                      [&](const PolarScan& scan) {
                        seen.push_back(scan.sequence);
                        begun.open();
                        door.wait();
                      },
                      newest()));
  const auto scans = made_scans(10);
  bus.write(scans[0]);
  begun.wait();
  for (std::size_t i = 1; i < scans.size(); ++i) bus.write(scans[i]);
  door.open();
  bus.finish();
  EXPECT_EQ(seen, (std::vector<std::uint64_t>{0, 8, 9}));
  EXPECT_EQ(bus.sinks()[0].written, 3U);
  EXPECT_EQ(bus.sinks()[0].lost, 7U);
  EXPECT_EQ(heard.count("sink_slow"), 1);
}

TEST(ScanBus, SinkThatThrowsIsClosedAndSaidWithWhatItThrew) {
  Heard heard;
  ScanBus bus(heard.port());
  int calls = 0;
  bus.add("bad", std::make_unique<SinkThat>([&](const PolarScan& scan) {
            ++calls;
            if (scan.sequence == 10) throw Error(ErrorKind::kDevice, "the plug is out");
          }));
  for (const auto& scan : made_scans(50)) bus.write(scan);
  bus.finish();
  EXPECT_EQ(calls, 11);
  EXPECT_EQ(bus.sinks()[0].state, SinkReport::State::kClosed);
  EXPECT_EQ(bus.sinks()[0].written, 10U);
  EXPECT_EQ(bus.sinks()[0].lost, 40U);
  EXPECT_FALSE(bus.is_any_open());
  EXPECT_EQ(heard.count("sink_failed"), 1);
  EXPECT_THROW(std::rethrow_exception(bus.failure()), Error);
}

TEST(ScanBus, FullDiskHasAWordOfItsOwn) {
  Heard heard;
  ScanBus bus(heard.port());
  for (const char* const uri : {"csv:/dev/full", "jsonl:/dev/full"}) bus.add(uri, open_sink(uri));
  bus.open({});
  for (const auto& scan : made_scans(20)) bus.write(scan);
  bus.finish();
  EXPECT_EQ(heard.count("disk_full"), 2);
  EXPECT_EQ(heard.count("sink_failed"), 0);
  for (const SinkReport& report : bus.sinks()) {
    EXPECT_EQ(report.written, 0U);
    EXPECT_EQ(report.lost, 20U);
  }
}

TEST(ScanBus, SinkThatNeverReturnsIsLeftBehind) {
  Heard heard;
  const Door door;
  int healthy = 0;
  ScanBus bus(heard.port(), impatient());
  bus.add("stuck", std::make_unique<SinkThat>([door](const PolarScan&) { door.wait(); }));
  bus.add("healthy", std::make_unique<SinkThat>([&](const PolarScan&) { ++healthy; }));
  bus.open({});
  for (const auto& scan : made_scans(100)) bus.write(scan);
  bus.finish();
  EXPECT_EQ(healthy, 100);
  EXPECT_EQ(bus.sinks()[0].state, SinkReport::State::kClosed);
  EXPECT_EQ(bus.sinks()[0].written, 0U);
  EXPECT_EQ(bus.sinks()[0].lost, 100U);
  EXPECT_EQ(heard.count("sink_failed"), 1);
  let_go(door);
}

// Finishing and closing may hang as well as writing.
class SinkThatHangsAtTheEnd : public ScanSink {
 public:
  explicit SinkThatHangsAtTheEnd(const Door& door) : door_(door) {}
  void finish() override { door_.wait(); }

 private:
  Door door_;
};

TEST(ScanBus, SinkThatNeverFinishesIsLeftBehind) {
  Heard heard;
  const Door door;
  ScanBus bus(heard.port(), impatient());
  bus.add("stuck", std::make_unique<SinkThatHangsAtTheEnd>(door));
  bus.write(made_scans(1)[0]);
  bus.finish();
  EXPECT_EQ(bus.sinks()[0].state, SinkReport::State::kClosed);
  EXPECT_EQ(heard.count("sink_failed"), 1);
  let_go(door);
}

// Notes what a sink hears, in order.
class NotingSink : public ScanSink {
 public:
  NotingSink(std::vector<std::string>& notes, const SinkNeeds& needs)
      : notes_(notes), needs_(needs) {}
  SinkNeeds needs() const override { return needs_; }
  void open(const HeadInfo& head) override { notes_.push_back("open " + head.head); }
  void write(const PolarScan& /*scan*/) override { notes_.emplace_back("scan"); }
  void write(const Frame& frame) override {
    notes_.push_back("frame " + std::to_string(frame.image.rows));
  }
  void status(const ScannerStatus& status) override {
    notes_.push_back("status " + std::to_string(status.counts.frames));
  }
  void event(const Event& event) override { notes_.emplace_back(event.code.word()); }
  void finish() override { notes_.emplace_back("finish"); }

 private:
  std::vector<std::string>& notes_;
  SinkNeeds needs_;
};

TEST(ScanBus, SinkHearsEverythingItNeedsInOrder) {
  std::vector<std::string> all;
  std::vector<std::string> least;
  ScanBus bus;
  bus.add("all", std::make_unique<NotingSink>(all, SinkNeeds{true, true, 1.0}));
  bus.add("least", std::make_unique<NotingSink>(least, SinkNeeds{false, false, 0.0}));
  Frame frame;
  frame.image = cv::Mat::zeros(3, 4, CV_8UC1);
  bus.open({});
  bus.write(frame);
  bus.write(frame);  // Sooner than a second later.
  bus.write(made_scans(1)[0]);
  bus.event({"source_lost", "gone"});
  bus.status({});
  bus.finish();
  EXPECT_EQ(all, (std::vector<std::string>{"open striper", "frame 3", "scan", "source_lost",
                                           "status 0", "finish"}));
  EXPECT_EQ(least, (std::vector<std::string>{"open striper", "source_lost", "finish"}));
}

// A rig's heads each have their own frames, told apart and no less often for the others'.
TEST(ScanBus, FramesAreOfTheirHeadAndLimitedForEach) {
  std::vector<std::string> heads;
  class FrameSink : public ScanSink {
   public:
    explicit FrameSink(std::vector<std::string>& heads) : heads_(heads) {}
    using ScanSink::write;
    SinkNeeds needs() const override { return {false, false, 0.001}; }
    void write(const Frame& frame) override { heads_.push_back(frame.head); }

   private:
    std::vector<std::string>& heads_;
  };
  ScanBus bus;
  bus.add("frames", std::make_unique<FrameSink>(heads));
  Frame frame;
  frame.image = cv::Mat::zeros(3, 4, CV_8UC1);
  for (int i = 0; i < 2; ++i) {
    bus.write(frame, "left");
    bus.write(frame, "right");
  }
  bus.write(frame);
  bus.finish();
  EXPECT_EQ(heads, (std::vector<std::string>{"left", "right", "striper"}));
}

TEST(ScanBus, StatusComesWhenItChangesAndOnceInAWhile) {
  std::vector<std::string> notes;
  BusOptions options;
  options.status_every = 200ms;
  ScanBus bus({}, options);
  bus.add("all", std::make_unique<NotingSink>(notes, SinkNeeds{true, true, 0.0}));
  const auto tell = [&](std::uint64_t frames, bool is_seen) {
    ScannerStatus status;
    status.counts.frames = frames;
    status.is_stripe_seen = is_seen;
    bus.status(status);
    std::this_thread::sleep_for(20ms);
  };
  tell(1, false);
  tell(2, false);  // Only counts.
  tell(3, true);
  std::this_thread::sleep_for(200ms);
  tell(4, true);
  bus.finish();
  EXPECT_EQ(notes, (std::vector<std::string>{"status 1", "status 3", "status 4", "finish"}));
}

// As serve does: what a sink's end says goes to the others.
TEST(ScanBus, EventsOfTheBusMayComeBackToIt) {
  std::vector<std::string> notes;
  ScanBus* to = nullptr;
  ScanBus bus(EventPort([&](const Event& event) { to->event(event); }));
  to = &bus;
  bus.add("bad", std::make_unique<SinkThat>([](const PolarScan&) { throw 7; }));
  bus.add("all", std::make_unique<NotingSink>(notes, SinkNeeds{}));
  bus.write(made_scans(1)[0]);
  while (bus.sinks()[0].state == SinkReport::State::kOpen) std::this_thread::sleep_for(1ms);
  std::this_thread::sleep_for(20ms);
  bus.finish();
  EXPECT_THAT(notes, ::testing::UnorderedElementsAre("scan", "sink_failed", "finish"));
  EXPECT_EQ(notes.back(), "finish");
}

TEST(ScanBus, AllocatesNothingPerScanOnceWarm) {
  const testing::ScratchDirectory scratch;
  ScanBus bus;
  for (const char* const name : {"a.csv?missing=yes", "a.jsonl"}) {
    bus.add(name, open_sink((scratch / name).string()));
  }
  bus.open({});
  const auto scans = made_scans(200);
  const auto write_them = [&] {
    for (const auto& scan : scans) bus.write(scan);
    while (bus.sinks()[0].written % scans.size() != 0 ||
           bus.sinks()[1].written % scans.size() != 0) {
      std::this_thread::sleep_for(1ms);
    }
  };
  write_them();
  const testing::AllocationCounter counter;
  for (const auto& scan : scans) bus.write(scan);
  std::this_thread::sleep_for(300ms);
  EXPECT_EQ(counter.count(), 0U);
  bus.finish();
  EXPECT_EQ(bus.sinks()[0].written, 400U);
}

}  // namespace
}  // namespace striper
