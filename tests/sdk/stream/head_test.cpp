// SPDX-License-Identifier: Apache-2.0
// Proves that a head gives what its scanner makes of its source, waits for a source and opens a
// lost one again, each said once and in order, and takes up a new model or keeps the old one. Real
// cameras that come and go are in tests/end_to_end/serve_test.py.
#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/stream/head.hpp>

#include "support/error_of.hpp"
#include "support/models.hpp"
#include "support/sinks.hpp"
#include "support/synthetic_stripe.hpp"

namespace striper {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

Frame frame_of_wall() {
  testing::SyntheticStripe stripe;
  stripe.lines = 640;
  stripe.length = 480;
  const double row = Triangulator(testing::paper_model(), 0).project(2.0, 0.0).pixel.y();
  stripe.position = [row](int) { return row; };
  Frame frame;
  frame.image = testing::render(stripe).lit;
  frame.sensor_size = frame.image.size();
  return frame;
}

// Gives so many frames, then ends: as a file does, or as a camera that is lost. A camera that is
// silent gives none and times out.
class FakeSource : public FrameSource {
 public:
  FakeSource(std::uint64_t frames, bool is_live) : frames_(frames), is_live_(is_live) {}

  SourceInfo info() const override {
    SourceInfo info;
    info.uri = "images:fake";
    info.description = "a fake source";
    info.image_size = info.sensor_size = {640, 480};
    info.is_live = is_live_;
    info.pattern = IlluminationPattern::parse("0");
    return info;
  }
  void start() override {}
  NextStatus next(Frame& frame, std::chrono::milliseconds timeout) override {
    if (frames_ == kSilent) {
      std::this_thread::sleep_for(std::min<std::chrono::milliseconds>(timeout, 5ms));
      return NextStatus::kTimeout;
    }
    if (given_ == frames_) return NextStatus::kEnd;
    frame = frame_;
    frame.sequence = given_ * numbers_apart_;
    ++given_;
    return NextStatus::kFrame;
  }
  void stop() override {}
  SourceStatistics statistics() const override {
    SourceStatistics statistics;
    statistics.delivered = given_;
    return statistics;
  }

  Controls& controls() override { return controls_; }

  /// Has a control `laser`, whose state is kept elsewhere, since sources come and go.
  void set_laser(double& is_on) {
    const auto read = [&is_on] { return ControlState{{is_on}, {0.0}, {1.0}}; };
    const auto write = [&is_on](const ControlValue& value) { is_on = value[0]; };
    controls_ = Controls("fake", {{"laser", ControlType::kSwitch, "", read, write}});
  }

  /// A number that is not 1 has frames missing between those that come.
  void set_numbers_apart(std::uint64_t numbers) { numbers_apart_ = numbers; }

  static constexpr std::uint64_t kSilent = ~std::uint64_t{0};

 private:
  std::uint64_t frames_;
  bool is_live_;
  std::uint64_t given_ = 0;
  std::uint64_t numbers_apart_ = 1;
  Controls controls_;
  Frame frame_ = frame_of_wall();
};

// A head with a fake source, one sink that keeps the scans, and what was said.
class HeadTest : public ::testing::Test {
 protected:
  HeadTest() {
    parts_.open = [this](const EventPort&) { return open_(); };
    parts_.make_scanner =
        parts_.remake_scanner = [this](const SourceInfo& source, const EventPort& port) {
          return make_scanner(source, port);
        };
    options_.retry_every = 1ms;
    options_.events = EventPort([this](const Event& event) {
      said_.emplace_back(event.code.word());
      ++times_said_;
    });
    bus_.add("keep", std::make_unique<testing::SinkThat>(
                         [this](const PolarScan& scan) { heads_.emplace_back(scan.head()); }));
  }

  HeadScanner make_scanner(const SourceInfo& source, const EventPort& port) {
    if (is_model_bad_) throw Error(ErrorKind::kBadFile, "the model is broken");
    ScannerOptions options = ScannerOptions::for_model(*model_);
    options.head = options_.name;
    options.events = port;
    options.stripe.method = ExtractMethod::kPaper;
    options.ambient.pattern = source.pattern;
    return {Scanner(*model_, options), model_, StripeAxis::kColumns};
  }

  // While a head runs on its own thread, nobody else looks at `said_`.
  void wait_until_said(std::size_t times) const {
    for (int i = 0; i < 1000 && times_said_ < times; ++i) std::this_thread::sleep_for(10ms);
    EXPECT_GE(times_said_, times);
  }

  static std::unique_ptr<FrameSource> file(std::uint64_t frames) {
    return std::make_unique<FakeSource>(frames, false);
  }
  static std::unique_ptr<FrameSource> camera(std::uint64_t frames) {
    return std::make_unique<FakeSource>(frames, true);
  }

  std::function<std::unique_ptr<FrameSource>()> open_ = [] { return file(5); };
  std::shared_ptr<const StriperModel> model_ =
      std::make_shared<const StriperModel>(testing::paper_model());
  std::atomic<bool> is_model_bad_ = false;
  HeadParts parts_;
  HeadOptions options_;
  std::vector<std::string> said_;
  std::atomic<std::size_t> times_said_ = 0;
  std::vector<std::string> heads_;
  ScanBus bus_;
};

TEST_F(HeadTest, GivesEveryScanOfASourceToItsEnd) {
  options_.name = "left";
  Head head(parts_, options_, bus_);
  const FrameReport report = head.run();
  bus_.finish();
  EXPECT_EQ(report.frames, 5U);
  EXPECT_FALSE(report.has_failed());
  EXPECT_EQ(heads_, std::vector<std::string>(5, "left"));
  EXPECT_THAT(said_, ElementsAre("source_opened", "source_ended"));
  EXPECT_EQ(head.health().state, SourceState::kEnded);
  EXPECT_EQ(head.health().scanner.head, "left");
  EXPECT_EQ(head.health().scanner.counts.scans, 5U);
}

TEST_F(HeadTest, KeepsToItsLimits) {
  options_.limits.pictures = 3;
  EXPECT_EQ(Head(parts_, options_, bus_).run().pictures, 3U);
}

TEST_F(HeadTest, WatchersSeeFramesBeforeTheirScans) {
  std::string seen;
  parts_.before_scan = [&](const Frame&) { seen += 'f'; };
  parts_.after_scan = [&](ScanSpan scans) { seen += std::to_string(scans.size()); };
  Head(parts_, options_, bus_).run();
  EXPECT_EQ(seen, "f1f1f1f1f10");
}

TEST_F(HeadTest, SourceThatIsNotThereIsAnErrorWhereNobodyWaits) {
  open_ = []() -> std::unique_ptr<FrameSource> { throw Error(ErrorKind::kNotFound, "no camera"); };
  Head head(parts_, options_, bus_);
  EXPECT_EQ(testing::error_of([&] { head.run(); }).kind(), ErrorKind::kNotFound);
}

TEST_F(HeadTest, WaitsForASourceThatIsNotThereYet) {
  int tries = 0;
  open_ = [&]() -> std::unique_ptr<FrameSource> {
    if (++tries < 4) throw Error(ErrorKind::kNotFound, "no camera");
    return file(2);
  };
  options_.reopens = true;
  EXPECT_EQ(Head(parts_, options_, bus_).run().frames, 2U);
  EXPECT_THAT(said_, ElementsAre("source_waiting", "source_opened", "source_back", "source_ended"));
}

TEST_F(HeadTest, WrongAddressIsNotWaitedFor) {
  open_ = []() -> std::unique_ptr<FrameSource> { throw Error(ErrorKind::kUsage, "no such key"); };
  options_.reopens = true;
  Head head(parts_, options_, bus_);
  EXPECT_EQ(testing::error_of([&] { head.run(); }).kind(), ErrorKind::kUsage);
}

TEST_F(HeadTest, OpensALostCameraAgain) {
  int opened = 0;
  open_ = [&]() -> std::unique_ptr<FrameSource> {
    if (++opened == 2) throw Error(ErrorKind::kDevice, "it is off");
    return opened < 4 ? camera(3) : file(1);
  };
  options_.reopens = true;
  const FrameReport report = Head(parts_, options_, bus_).run();
  bus_.finish();
  EXPECT_EQ(report.frames, 7U);
  EXPECT_FALSE(report.is_lost);
  EXPECT_EQ(heads_.size(), 7U);
  EXPECT_THAT(said_, ElementsAre("source_opened", "source_waiting", "source_opened", "source_back",
                                 "source_waiting", "source_opened", "source_back", "source_ended"));
}

TEST_F(HeadTest, LostCameraEndsItWhereNobodyWaits) {
  open_ = [] { return camera(3); };
  EXPECT_TRUE(Head(parts_, options_, bus_).run().is_lost);
}

TEST_F(HeadTest, StopsWhileItWaitsAndWhileItReads) {
  options_.reopens = true;
  for (const bool is_there : {false, true}) {
    open_ = [&]() -> std::unique_ptr<FrameSource> {
      if (!is_there) throw Error(ErrorKind::kNotFound, "no camera");
      return camera(FakeSource::kSilent);
    };
    Head head(parts_, options_, bus_);
    head.start();
    std::this_thread::sleep_for(20ms);
    EXPECT_TRUE(head.is_running());
    head.request_stop();
    EXPECT_TRUE(head.wait().interrupted);
    EXPECT_FALSE(head.is_running());
  }
}

TEST_F(HeadTest, ThreadsErrorsComeToWhoWaits) {
  is_model_bad_ = true;
  Head head(parts_, options_, bus_);
  head.start();
  EXPECT_EQ(testing::error_of([&] { head.wait(); }).kind(), ErrorKind::kBadFile);
}

TEST_F(HeadTest, TakesUpANewModelOrKeepsTheOldOne) {
  open_ = [] { return camera(FakeSource::kSilent); };
  Head head(parts_, options_, bus_);
  head.start();
  wait_until_said(1);
  is_model_bad_ = true;
  head.reload();
  wait_until_said(2);
  is_model_bad_ = false;
  head.reload();
  wait_until_said(3);
  head.request_stop();
  head.wait();
  EXPECT_THAT(said_, ElementsAre("source_opened", "model_refused", "model_reloaded"));
}

// The laser stays off when the source is opened again, as a camera does that was lost.
TEST_F(HeadTest, PausesAndKeepsWhatWasSet) {
  double is_on = 1.0;
  open_ = [&] {
    is_on = 1.0;
    auto source = std::make_unique<FakeSource>(FakeSource::kSilent, true);
    source->set_laser(is_on);
    return source;
  };
  Head head(parts_, options_, bus_);
  EXPECT_EQ(testing::error_of([&] { head.controls(); }).kind(), ErrorKind::kDevice);
  head.start();
  wait_until_said(1);
  EXPECT_EQ(head.controls().at(0).name, "laser");
  head.switch_lasers(false);
  EXPECT_EQ(is_on, 0.0);
  EXPECT_EQ(testing::error_of([&] { head.set_control("gain_db", {1.0}); }).kind(),
            ErrorKind::kUsage);
  head.pause();
  wait_until_said(2);
  for (int i = 0; i < 100 && head.health().state != SourceState::kPaused; ++i)
    std::this_thread::sleep_for(10ms);
  EXPECT_EQ(to_string(head.health().state), "paused");
  EXPECT_THROW(head.set_control("laser", {1.0}), Error);
  head.resume();
  wait_until_said(3);
  EXPECT_EQ(head.controls().at(0).state.value, ControlValue{0.0});
  EXPECT_EQ(head.set_control("laser", {1.0}).state.value, ControlValue{1.0});
  head.request_stop();
  head.wait();
  EXPECT_THAT(said_, ElementsAre("source_opened", "source_paused", "source_opened"));
}

TEST_F(HeadTest, LasersThatCannotBeSwitchedAreSaid) {
  open_ = [] { return camera(FakeSource::kSilent); };
  Head head(parts_, options_, bus_);
  head.switch_lasers(false);  // Kept for the source to come, which refuses.
  head.start();
  wait_until_said(2);
  EXPECT_EQ(testing::error_of([&] { head.switch_lasers(false); }).kind(), ErrorKind::kUsage);
  head.request_stop();
  head.wait();
  EXPECT_THAT(said_, ElementsAre("control_refused", "source_opened"));
}

TEST_F(HeadTest, StopsWhileItIsPaused) {
  open_ = [] { return camera(FakeSource::kSilent); };
  Head head(parts_, options_, bus_);
  head.pause();
  head.start();
  wait_until_said(1);
  head.request_stop();
  EXPECT_TRUE(head.wait().interrupted);
  EXPECT_THAT(said_, ElementsAre("source_paused"));
}

// At once, and then what came since as one: of a camera, since a file's numbers are its own.
TEST_F(HeadTest, FramesThatAreMissingAreSaid) {
  for (const bool is_live : {true, false}) {
    said_.clear();
    open_ = [&] {
      auto source = std::make_unique<FakeSource>(5, is_live);
      source->set_numbers_apart(3);
      return source;
    };
    Head(parts_, options_, bus_).run();
    const auto times = std::count(said_.begin(), said_.end(), "frames_dropped");
    EXPECT_EQ(times, is_live ? 2 : 0);
  }
}

TEST_F(HeadTest, CountsGoOnWithANewModel) {
  int spans = 0;
  HeadParts parts = parts_;
  Head* running = nullptr;
  parts.after_scan = [&](ScanSpan) {
    if (spans++ == 1) running->reload();
  };
  Head head(std::move(parts), options_, bus_);
  running = &head;
  head.run();
  EXPECT_THAT(said_, ElementsAre("source_opened", "model_reloaded", "source_ended"));
  EXPECT_EQ(head.health().scanner.counts.frames, 5U);
  EXPECT_EQ(head.health().scanner.counts.scans, 5U);
}

TEST_F(HeadTest, BusHearsOfItWithItsFirstFrame) {
  class NotingSink : public ScanSink {
   public:
    explicit NotingSink(int& opened) : opened_(opened) {}
    void open(const HeadInfo& head) override {
      ++opened_;
      EXPECT_EQ(head.frames.at(0)->frame_id, "striper_scan0");
      EXPECT_EQ(head.source.description, "a fake source");
    }

   private:
    int& opened_;
  };
  for (const std::uint64_t frames : {0U, 2U}) {
    int opened = 0;
    ScanBus bus;
    bus.add("note", std::make_unique<NotingSink>(opened));
    open_ = [&] { return file(frames); };
    Head(parts_, options_, bus).run();
    bus.finish();
    EXPECT_EQ(opened, frames > 0 ? 1 : 0);
  }
}

}  // namespace
}  // namespace striper
