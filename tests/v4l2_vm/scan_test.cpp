// SPDX-License-Identifier: Apache-2.0
// Proves the whole path on the kernel's own driver: what the simulator renders (interlaced, the
// laser in one field, bright sun), sent through the driver, gives the pictures bit for bit and the
// scans to 1e-9 m that it gives when it feeds the scanner directly; and that faults lose scans and
// never falsify one.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/capture/sync_check.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>
#include <striper/v4l2/v4l2_source.hpp>

#include "support/shared_data.hpp"
#include "v4l2/pixel_format.hpp"
#include "v4l2_vm/vivid.hpp"

namespace striper::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

struct Way {
  std::string name;
  std::string query;
  std::uint32_t code;
  std::uint32_t field;
  bool bottom_first = true;
  v4l2_std_id standard = V4L2_STD_NTSC_M;
};

void PrintTo(const Way& way, std::ostream* out) { *out << way.name; }

std::vector<Way> ways() {
  constexpr std::uint32_t kGrey = V4L2_PIX_FMT_GREY;
  return {
      {"grey_interlaced", "format=GREY", kGrey, V4L2_FIELD_INTERLACED},
      {"grey_top_first", "format=GREY&field=interlaced-tb", kGrey, V4L2_FIELD_INTERLACED_TB, false},
      {"grey_bottom_first", "format=GREY&field=interlaced-bt", kGrey, V4L2_FIELD_INTERLACED_BT},
      {"grey_alternate", "format=GREY&field=alternate", kGrey, V4L2_FIELD_ALTERNATE},
      {"yuyv_interlaced", "format=YUYV", V4L2_PIX_FMT_YUYV, V4L2_FIELD_INTERLACED},
      {"y16_interlaced", "format=Y16", V4L2_PIX_FMT_Y16, V4L2_FIELD_INTERLACED},
  };
}

struct World {
  Frame picture;
  StriperModel model;
};

// The scene with its laser in the first field, whichever that is. Rendered once: emulation is slow.
const World& world_of(const Way& way) {
  static const auto kRender = [](ScanMode scan) {
    Scene scene = load_scene(source_path("data/scenes/ntsc_grabber.yaml"));
    scene.timing.scan = scan;
    Simulator simulator(std::move(scene));
    return World{simulator.render(0), simulator.model()};
  };
  static const World kBottomFirst = kRender(ScanMode::kBottomFirst);
  static const World kTopFirst = kRender(ScanMode::kTopFirst);
  return way.bottom_first ? kBottomFirst : kTopFirst;
}

// A picture as the camera of this way has it: 8 bits, or the same spread over 16.
Frame as_sent(const Frame& rendered, std::uint32_t code) {
  Frame frame = rendered;
  frame.illumination = Illumination::unknown();
  if (code == V4L2_PIX_FMT_Y16) {
    rendered.image.convertTo(frame.image, CV_16U, 256.0);
    frame.bit_depth = 16;
  }
  return frame;
}

std::vector<std::uint8_t> lines_of(const cv::Mat& image, std::uint32_t code, int first, int step) {
  std::vector<std::uint8_t> bytes;
  for (int row = first; row < image.rows; row += step) {
    const std::uint8_t* const from = image.ptr(row);
    const std::size_t count = static_cast<std::size_t>(image.cols) * image.elemSize();
    for (std::size_t at = 0; at < count; ++at) {
      bytes.push_back(from[at]);
      if (code == V4L2_PIX_FMT_YUYV) bytes.push_back(128);
    }
  }
  return bytes;
}

std::vector<std::vector<std::uint8_t>> buffers_of(const cv::Mat& image, const Way& way) {
  if (way.field != V4L2_FIELD_ALTERNATE) return {lines_of(image, way.code, 0, 1)};
  const int first = way.bottom_first ? 1 : 0;
  return {lines_of(image, way.code, first, 2), lines_of(image, way.code, 1 - first, 2)};
}

// The scans of one picture over and over, without any camera.
PolarScan direct_scan(const Frame& picture, const StriperModel& model) {
  ScannerOptions options = ScannerOptions::for_model(model);
  options.ambient.cadence = Cadence::parse("0,dark");
  Scanner scanner(model, options);
  PolarScan last;
  for (std::uint64_t number = 0; number < 8; ++number) {
    Frame frame = picture;
    frame.sequence = number;
    frame.time.monotonic_ns = static_cast<std::int64_t>(number) * 33'366'667;
    for (const PolarScan& scan : scanner.process(frame)) last = scan;
  }
  return last;
}

double largest_difference_m(const PolarScan& a, const PolarScan& b) {
  if (a.returns.size() != b.returns.size()) return INFINITY;
  double largest = 0.0;
  for (std::size_t at = 0; at < a.returns.size(); ++at) {
    const Return& x = a.returns[at];
    const Return& y = b.returns[at];
    if (x.status != y.status) return INFINITY;
    if (std::isnan(x.range_m) && std::isnan(y.range_m)) continue;
    largest = std::max(largest, std::abs(x.range_m - y.range_m));
  }
  return largest;
}

int good_returns(const PolarScan& scan) {
  return static_cast<int>(
      std::count_if(scan.returns.begin(), scan.returns.end(),
                    [](const Return& r) { return r.status == ReturnStatus::kOk; }));
}

class VividScan : public ::testing::TestWithParam<Way> {
 protected:
  void SetUp() override {
    if (!Node(output_path()).is_vivid())
      GTEST_SKIP() << "only the kernel's virtual driver has an output looped to its input";
  }
  void TearDown() override {
    const Node node(capture_path());
    if (node.is_vivid()) node.set(VividControl::kDroppedPercent, 0);
  }

  static Broadcast broadcast(const Way& way) {
    Broadcast sent;
    sent.standard = way.standard;
    sent.code = way.code;
    sent.field = way.field;
    return sent;
  }
  static std::unique_ptr<FrameSource> open(const Way& way) {
    return open_v4l2(V4l2Options::from_uri(SourceUri::parse(
        "v4l2:" + capture_path() + "?input=0&standard=ntsc-m&laser=0,dark&" + way.query)));
  }
};

TEST_P(VividScan, CameraGivesTheScansThatTheSimulatorGivesDirectly) {
  const Way& way = GetParam();
  const World& world = world_of(way);
  const Frame sent = as_sent(world.picture, way.code);
  const PolarScan expected = direct_scan(sent, world.model);
  ASSERT_GT(good_returns(expected), 600) << "the scene is to be seen";

  const auto source = open(way);
  const Transmitter transmitter(output_path(), broadcast(way), buffers_of(sent.image, way));
  source->start();
  ScannerOptions options = ScannerOptions::for_model(world.model);
  options.ambient.cadence = source->info().cadence;
  Scanner scanner(world.model, options);
  int scans = 0;
  int alike = 0;
  Frame frame;
  for (int number = 0; number < 60 && alike < 10; ++number) {
    ASSERT_EQ(source->next(frame, milliseconds(3000)), NextStatus::kFrame);
    for (const PolarScan& scan : scanner.process(frame)) {
      ++scans;
      if (largest_difference_m(scan, expected) <= 1e-9) ++alike;
    }
  }
  EXPECT_GE(alike, 10);
  // Before the first sent picture arrives there is the driver's own; the first and the last scan of
  // a stretch have a dark neighbour on one side only.
  EXPECT_LE(scans - alike, 6);
  EXPECT_EQ(scanner.statistics().refused, 0U);
}

INSTANTIATE_TEST_SUITE_P(Sent, VividScan, ::testing::ValuesIn(ways()),
                         [](const auto& way) { return way.param.name; });

using VividScanFaults = VividScan;

TEST_P(VividScanFaults, DropsAndDamageLoseScansAndNeverFalsifyOne) {
  const Way& way = GetParam();
  const World& world = world_of(way);
  const Frame sent = as_sent(world.picture, way.code);
  const PolarScan expected = direct_scan(sent, world.model);
  const auto source = open(way);
  const Transmitter transmitter(output_path(), broadcast(way), buffers_of(sent.image, way));
  source->start();
  ScannerOptions options = ScannerOptions::for_model(world.model);
  options.ambient.cadence = source->info().cadence;
  Scanner scanner(world.model, options);
  Frame frame;
  for (int number = 0; number < 10; ++number) {
    ASSERT_EQ(source->next(frame, milliseconds(3000)), NextStatus::kFrame);
    scanner.process(frame);
  }

  const Node node(capture_path());
  node.set(VividControl::kDroppedPercent, 20);
  int scans = 0;
  double worst_m = 0.0;
  for (int number = 0; number < 120; ++number) {
    if (number % 30 == 29) node.press(VividControl::kFlagError);
    ASSERT_EQ(source->next(frame, milliseconds(3000)), NextStatus::kFrame);
    for (const PolarScan& scan : scanner.process(frame)) {
      ++scans;
      int compared = 0;
      for (std::size_t at = 0; at < scan.returns.size(); ++at) {
        const Return& got = scan.returns[at];
        const Return& truth = expected.returns[at];
        if (got.status != ReturnStatus::kOk || truth.status != ReturnStatus::kOk) continue;
        ++compared;
        worst_m = std::max(worst_m, std::abs(got.range_m - truth.range_m) / truth.sigma_m);
      }
      EXPECT_GT(compared, 500) << "picture " << scan.sequence;
    }
  }
  EXPECT_GT(scans, 20);
  // Emulation is slow: a flagged picture may be among those discarded because nobody asked in time.
  EXPECT_GE(source->statistics().corrupt, 1U);
  EXPECT_LE(source->statistics().corrupt, 4U);
  EXPECT_GT(source->statistics().dropped, 5U);
  // With a dark neighbour on one side only the noise differs a little; a wrong pair is off by far
  // more.
  EXPECT_LT(worst_m, 10.0) << "standard deviations";
}

INSTANTIATE_TEST_SUITE_P(Sent, VividScanFaults, ::testing::Values(ways()[0], ways()[3]),
                         [](const auto& way) { return way.param.name; });

using VividSync = VividScan;

TEST_P(VividSync, CheckSeesTheLaserInItsField) {
  const Way& way = GetParam();
  const World& world = world_of(way);
  const auto source = open(way);
  const Transmitter transmitter(output_path(), broadcast(way),
                                buffers_of(as_sent(world.picture, way.code).image, way));
  source->start();
  Frame frame;
  for (int number = 0; number < 8; ++number) source->next(frame, milliseconds(3000));
  source->stop();
  const SyncReport report = check_sync(*source, {5.0, {}});
  EXPECT_EQ(report.verdict, SyncVerdict::kLocked)
      << report.lit_even << " even, " << report.lit_odd << " odd, " << report.undecided;
  EXPECT_EQ(report.lit_phase, 0);
  EXPECT_EQ(report.lit_field, way.bottom_first ? Field::kBottom : Field::kTop);
  // The two nodes are not in step: of single fields one may come twice, which no rate can fit.
  if (way.field != V4L2_FIELD_ALTERNATE) {
    EXPECT_NEAR(report.rate_hz, 30000.0 / 1001.0, 0.3);
  }
}

INSTANTIATE_TEST_SUITE_P(Sent, VividSync, ::testing::Values(ways()[0], ways()[1], ways()[3]),
                         [](const auto& way) { return way.param.name; });

}  // namespace
}  // namespace striper::testing
