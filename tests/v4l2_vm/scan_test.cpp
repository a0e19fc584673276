// SPDX-License-Identifier: Apache-2.0
// Proves the whole path on the kernel's own driver: what the simulator renders (interlaced, the
// laser in one field, bright sun), sent through the driver, gives the images bit for bit and the
// scans to 1e-9 m that it gives when it feeds the scanner directly; and that faults lose exactly
// the scans that they must and never falsify one.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <striper/ambient/sync_check.hpp>
#include <striper/v4l2/v4l2_source.hpp>

#include "capture/v4l2/interlaced_scene.hpp"
#include "v4l2/v4l2_stream.hpp"
#include "v4l2_vm/calls_between.hpp"
#include "v4l2_vm/vivid.hpp"

namespace striper::testing {
namespace {

using std::chrono::milliseconds;

// The driver does not loop sequential fields (see RelabelledFields).
bool is_relabelled(const Television& way) { return V4L2_FIELD_IS_SEQUENTIAL(way.field); }

std::unique_ptr<FrameSource> open(const Television& way, std::shared_ptr<WatchedCalls> watched) {
  const V4l2Options options = V4l2Options::from_uri(
      SourceUri::parse("v4l2:" + capture_path() + "?input=0&laser=0,dark&" + way.query()));
  if (!is_relabelled(way)) return detail::v4l2::open(options, std::move(watched));
  return detail::v4l2::open(options, std::make_shared<RelabelledFields>(
                                         std::move(watched), way.field, V4L2_FIELD_INTERLACED));
}

Broadcast broadcast(const Television& way) {
  Broadcast sent;
  sent.standard = way.standard;
  sent.code = way.code;
  sent.field = is_relabelled(way) ? std::uint32_t{V4L2_FIELD_INTERLACED} : way.field;
  sent.height = way.lines();
  return sent;
}

// A scene on the air and a camera and scanner that see it.
struct OnAir {
  explicit OnAir(const Television& way)
      : scene(way),
        source(open(way, watched)),
        transmitter(output_path(), broadcast(way), buffers_of(scene.whole.image, way)),
        scans(scene, source->info().pattern) {
    source->start();
  }

  // Reads past the driver's own frames, which come until the first sent one does.
  void skip_pattern() {
    Frame frame;
    for (int number = 0; number < 10; ++number) {
      ASSERT_EQ(source->next(frame, milliseconds(3000)), NextStatus::kFrame);
      if (is_part_of(frame, scene.whole.image)) return;
    }
    FAIL() << "what is sent does not arrive";
  }

  InterlacedScene scene;
  std::shared_ptr<WatchedCalls> watched = std::make_shared<WatchedCalls>();
  std::unique_ptr<FrameSource> source;
  Transmitter transmitter;
  SideBySide scans;
};

class VividScans : public ::testing::TestWithParam<Television> {
 protected:
  void SetUp() override {
    if (!Node(output_path()).is_vivid())
      GTEST_SKIP() << "only the kernel's virtual driver has an output looped to its input";
  }
};

TEST_P(VividScans, AreThoseThatTheSimulatorGivesDirectly) {
  constexpr std::size_t kScans = 5;
  OnAir air(GetParam());
  ASSERT_GT(air.scans.good_columns(), 600) << "the scene is to be seen";
  ASSERT_NO_FATAL_FAILURE(air.skip_pattern());
  Frame frame;
  for (int frames = 0; frames < 60 && air.scans.scanned().size() < kScans; ++frames) {
    ASSERT_EQ(air.source->next(frame, milliseconds(3000)), NextStatus::kFrame);
    ASSERT_TRUE(is_part_of(frame, air.scene.whole.image)) << "frame " << frames;
    air.scans.process(frame);
  }
  EXPECT_GE(air.scans.scanned().size(), kScans);
  EXPECT_LE(air.scans.worst_m(), 1e-9);
  EXPECT_EQ(air.scans.statistics().refused, 0U);
}

INSTANTIATE_TEST_SUITE_P(Sent, VividScans, ::testing::ValuesIn(ways_of_television()),
                         [](const auto& way) { return way.param.name; });

Television alternate() { return {"alternate", V4L2_PIX_FMT_GREY, V4L2_FIELD_ALTERNATE}; }

class VividScanFaults : public VividScans {
 protected:
  // Reads so many frames; `fault` is told the number of each before it is asked for. Scans them
  // afterwards: an emulated machine cannot at the rate at which they come.
  static void expect_honest_scans(OnAir& air, int frames, const std::function<void(int)>& fault) {
    std::vector<Frame> recorded;
    Frame frame;
    for (int number = 0; number < frames; ++number) {
      fault(number);
      ASSERT_EQ(air.source->next(frame, milliseconds(2000)), NextStatus::kFrame)
          << "hangs at frame " << number;
      recorded.push_back(without_pixels(frame));
      recorded.back().image = frame.image.clone();
    }
    air.source->stop();
    expect_what_was_sent(air, recorded);
    for (const Frame& one : recorded) air.scans.process(one);
    air.scans.finish();
    EXPECT_EQ(air.scans.scanned(), frames_with_a_pair(recorded));
    EXPECT_GT(air.scans.scanned().size(), static_cast<std::size_t>(frames / 8)) << "scans come";
    EXPECT_LE(air.scans.worst_m(), 1e-9);
    // With a dark neighbour on one side only the noise differs a little; a wrong pair is off by far
    // more.
    EXPECT_LT(air.scans.worst_sigmas(), 10.0) << "standard deviations";
  }

 private:
  // Every frame that came as good is the one that was sent. The driver's fatal error stops the
  // sender, too: while that begins anew the driver's own test pattern comes, as good as any signal.
  // It has no row of the scene, and is left out.
  static void expect_what_was_sent(const OnAir& air, std::vector<Frame>& recorded) {
    constexpr std::int64_t kMoment_ns = 100'000'000;
    const auto is_pattern = [&](const Frame& frame) {
      const bool is_sending =
          std::abs(frame.time.monotonic_ns - air.transmitter.began_anew_ns()) > kMoment_ns;
      return !is_sending && frame.status == FrameStatus::kOk &&
             lines_of(frame, air.scene.whole.image) == 0;
    };
    recorded.erase(std::remove_if(recorded.begin(), recorded.end(), is_pattern), recorded.end());
    for (const Frame& frame : recorded) {
      EXPECT_TRUE(frame.status != FrameStatus::kOk || is_part_of(frame, air.scene.whole.image))
          << "frame " << frame.sequence << ", exposure " << frame.exposure_in_picture;
    }
  }
};

TEST_P(VividScanFaults, DropsAndDamageLoseTheirOwnScansAndFalsifyNone) {
  constexpr std::uint64_t kFlagged = 4;
  OnAir air(GetParam());
  ASSERT_NO_FATAL_FAILURE(air.skip_pattern());
  const Node node(capture_path());
  node.set(VividControl::kDroppedPercent, 20);
  const int frames = GetParam().field == V4L2_FIELD_ALTERNATE ? 120 : 60;
  expect_honest_scans(air, frames, [&](int number) {
    if (number % (frames / 4) == 5) node.press(VividControl::kFlagError);
  });
  node.set(VividControl::kDroppedPercent, 0);
  const SourceStatistics counted = air.source->statistics();
  EXPECT_GT(counted.dropped, 3U);
  // The sending side of the driver may take the flag; of the others a late reader may discard some.
  EXPECT_LE(air.watched->flagged(), kFlagged);
  EXPECT_LE(counted.corrupt, air.watched->flagged());
  EXPECT_GE(counted.corrupt + counted.overrun, air.watched->flagged());
}

TEST_P(VividScanFaults, BrokenStreamAndLostSignalFalsifyNone) {
  OnAir air(GetParam());
  ASSERT_NO_FATAL_FAILURE(air.skip_pattern());
  const Node node(capture_path());
  expect_honest_scans(air, 60, [&](int number) {
    if (number == 15) node.press(VividControl::kFatalError);
    if (number == 30) node.set(VividControl::kSignalMode, static_cast<int>(SignalMode::kNone));
    if (number == 45) node.set(VividControl::kSignalMode, static_cast<int>(SignalMode::kGood));
  });
  node.set(VividControl::kSignalMode, static_cast<int>(SignalMode::kGood));
  const SourceStatistics counted = air.source->statistics();
  EXPECT_EQ(counted.reconnects, 1U);
  EXPECT_GE(counted.corrupt, 10U) << "15 frames without signal, but for those on their way";
}

INSTANTIATE_TEST_SUITE_P(Sent, VividScanFaults,
                         ::testing::Values(ways_of_television()[0], alternate()),
                         [](const auto& way) { return way.param.name; });

using VividSync = VividScans;

TEST_P(VividSync, CheckSeesTheLaserInItsField) {
  const Television& way = GetParam();
  OnAir air(way);
  ASSERT_NO_FATAL_FAILURE(air.skip_pattern());
  air.source->stop();
  constexpr double kLong_s = 30.0;  // An emulated machine reads a few frames a second of them.
  const SyncReport report = check_sync(*air.source, {kLong_s, {}});
  EXPECT_EQ(report.verdict, SyncVerdict::kLocked)
      << report.agreeing << " of " << report.windows << " agree, " << report.others << " others";
  EXPECT_EQ(report.pattern, IlluminationPattern::parse("0,dark"));
  EXPECT_EQ(report.lit_field, way.is_bottom_first() ? Field::kBottom : Field::kTop);
  // The two nodes are not in step: of single fields one may come twice, which no rate can fit.
  if (way.field != V4L2_FIELD_ALTERNATE) {
    EXPECT_NEAR(report.rate_hz, way.picture_rate_hz(), 0.3);
  }
}

std::vector<Television> ways_to_check_sync() {
  std::vector<Television> ways;
  for (const Television& way : ways_of_television()) {
    const bool is_told_apart = way.name == "grey_interlaced" || way.name == "grey_top_first" ||
                               way.name == "grey_alternate" || way.name == "pal_interlaced";
    if (is_told_apart) ways.push_back(way);
  }
  return ways;
}

INSTANTIATE_TEST_SUITE_P(Sent, VividSync, ::testing::ValuesIn(ways_to_check_sync()),
                         [](const auto& way) { return way.param.name; });

}  // namespace
}  // namespace striper::testing
