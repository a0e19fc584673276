// SPDX-License-Identifier: Apache-2.0
// Proves that a file gets every scan of a live camera beside sinks that sleep, throw, hang and fill
// their disk, and that their losses are counted to the last. Frames are made in advance and come
// 200 a second: for 3 s, and with STRIPER_FULL_TRIALS for 20.
#include <chrono>
#include <map>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/stream/open_sink.hpp>
#include <striper/stream/scan_bus.hpp>
#include <striper/stream/scan_files.hpp>

#include "support/instrumented.hpp"
#include "support/models.hpp"
#include "support/scratch_directory.hpp"
#include "support/sinks.hpp"
#include "support/synthetic_stripe.hpp"

namespace striper {
namespace {

using namespace std::chrono_literals;

#ifdef STRIPER_FULL_TRIALS
constexpr std::uint64_t kFrames = 20 * 200;
#else
constexpr std::uint64_t kFrames = 3 * 200;
#endif
// Under a sanitizer a scan takes as long to write as some of them to come.
constexpr std::chrono::milliseconds kPeriod = testing::kIsInstrumented ? 20ms : 5ms;
constexpr std::chrono::milliseconds kSleep = 50ms;

std::vector<Frame> made_frames(const StriperModel& model) {
  std::vector<Frame> frames;
  for (const double range_m : {1.5, 2.0, 2.5}) {
    testing::SyntheticStripe stripe;
    stripe.lines = 640;
    stripe.length = 480;
    stripe.position = [row = Triangulator(model, 0).project(range_m, 0.0).pixel.y()](int) {
      return row;
    };
    frames.emplace_back().image = testing::render(stripe).lit;
    frames.back().sensor_size = frames.back().image.size();
  }
  return frames;
}

// What a bus says, by the word of its code.
struct Said {
  std::map<std::string, int> times;
  EventPort port() {
    return EventPort([this](const Event& event) { ++times[std::string(event.code.word())]; });
  }
};

std::unique_ptr<ScanSink> sleeping_sink() {
  SinkNeeds needs;
  needs.delivery = Delivery::kNewest;
  return std::make_unique<testing::SinkThat>(
      [](const PolarScan&) { std::this_thread::sleep_for(kSleep); }, needs);
}

std::unique_ptr<ScanSink> throwing_sink() {
  return std::make_unique<testing::SinkThat>([](const PolarScan& scan) {
    if (scan.sequence == 10) throw Error(ErrorKind::kDevice, "no more than ten");
  });
}

std::uint64_t stream(const StriperModel& model, ScanBus& bus) {
  ScannerOptions options = ScannerOptions::for_model(model);
  options.stripe.method = ExtractMethod::kPaper;
  options.ambient.pattern = IlluminationPattern::parse("0");
  Scanner scanner(model, options);
  const std::vector<Frame> frames = made_frames(model);
  std::uint64_t scans = 0;
  auto due = std::chrono::steady_clock::now();
  for (std::uint64_t n = 0; n < kFrames; ++n) {
    std::this_thread::sleep_until(due += kPeriod);
    Frame frame = frames[n % frames.size()];
    frame.sequence = n;
    const ScanSpan given = scanner.process(frame);
    bus.write(given);
    scans += given.size();
  }
  return scans;
}

std::uint64_t scans_in(const std::string& path) {
  const auto source = read_csv_scans(path);
  PolarScan scan;
  std::uint64_t count = 0;
  while (source->next(scan, 0ms) == NextStatus::kFrame) {
    EXPECT_EQ(scan.sequence, count++);
    EXPECT_EQ(scan.returns.size(), 640U);
  }
  return count;
}

TEST(AllSinks, FileGetsEveryScanBesideOnesThatFail) {
  const testing::ScratchDirectory scratch;
  const StriperModel model = testing::paper_model();
  const std::string path = (scratch / "scans.csv").string();
  const testing::Door door;
  Said said;
  BusOptions options;
  if (kFrames < 1000) options.stuck_after = 1000ms;       // Within the shorter run.
  if (testing::kIsInstrumented) options.live_hold = 60s;  // Its times are not the product's.
  ScanBus bus(said.port(), options);
  bus.add("csv", open_sink(path + "?missing=yes"));
  bus.add("sleeping", sleeping_sink());
  bus.add("throwing", throwing_sink());
  bus.add("stuck", std::make_unique<testing::SinkThat>([door](const PolarScan&) { door.wait(); }));
  bus.add("full", open_sink("csv:/dev/full"));
  HeadInfo head;
  head.source.is_live = true;
  bus.open(head);

  const auto start = std::chrono::steady_clock::now();
  const std::uint64_t scans = stream(model, bus);
  const auto elapsed = std::chrono::steady_clock::now() - start;
  bus.finish();
  EXPECT_EQ(scans, kFrames);
  const std::vector<SinkReport> sinks = bus.sinks();
  for (const SinkReport& sink : sinks) {
    EXPECT_EQ(sink.written + sink.lost, kFrames) << sink.uri;
    std::printf("%-9s %s, written %lu, lost %lu\n", sink.uri.c_str(),
                std::string(to_string(sink.state)).c_str(), sink.written, sink.lost);
  }
  EXPECT_EQ(sinks[0].lost, 0U);
  EXPECT_EQ(scans_in(path), kFrames);
  EXPECT_LE(sinks[1].written, static_cast<std::uint64_t>(elapsed / kSleep) + 3);
  EXPECT_EQ(sinks[2].written, 10U);
  EXPECT_EQ(sinks[3].written, 0U);
  EXPECT_EQ(sinks[4].written, 0U);
  EXPECT_EQ(said.times["sink_failed"], 2);
  EXPECT_EQ(said.times["disk_full"], 1);
  EXPECT_GE(said.times["sink_slow"], 4);  // The sum of each that lost something.
  door.open();
  std::this_thread::sleep_for(50ms);
}

}  // namespace
}  // namespace striper
