// SPDX-License-Identifier: Apache-2.0
// Proves over real packets on loopback that fast streams become scans without a frame lost, that
// resend saves whole streams, and that a camera which is killed and started again twenty times is
// opened again every time, with its settings, its laser in step and nothing left behind. The camera
// and the reader share one machine, so this says little about network cards.
#include <algorithm>
#include <chrono>
#include <fstream>
#include <thread>
#include <vector>

#include <dirent.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/simulator.hpp>

#include "capture/gige/taken_pictures.hpp"
#include "capture/gige/virtual_striper.hpp"
#include "support/instrumented.hpp"

namespace striper::testing {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

#ifdef STRIPER_SOAK
constexpr auto kStreamFor = 60s;
#else
constexpr auto kStreamFor = 20s;
#endif

// A sanitizer keeps records of its own; AddressSanitizer says by itself what leaks.
constexpr bool kMeasuresMemory = !testing::kIsInstrumented;

struct Traffic {
  const char* name;
  int width;
  int height;
  double rate_hz;
};

void PrintTo(const Traffic& traffic, std::ostream* out) { *out << traffic.name; }

class GigeStream : public ::testing::TestWithParam<Traffic> {};

TEST_P(GigeStream, BecomesScansWithoutLoss) {
  const auto [name, width, height, rate_hz] = GetParam();
  VirtualCameraOptions options;
  options.link_mbit_s = 10000.0;
  Scene wall = Scene::flat_wall(2.0);
  wall.camera = Scene::pinhole(width, height, 55.0);
  wall.timing.picture_rate_hz = rate_hz;
  const VirtualStriper striper(make_looped_scene(make_virtual_scene(wall), 2), options);
  const auto source = striper.open(fmt::format("fps={}&exposure_us=20", rate_hz));
  Scanner scanner(Simulator(wall).model());
  source->start();
  std::vector<double> latencies_ms;
  std::uint64_t scans = 0;
  std::size_t good_returns = 0;
  const auto take = [&](ScanSpan given) {
    scans += given.size();
    for (const PolarScan& scan : given) {
      good_returns += static_cast<std::size_t>(
          std::count_if(scan.returns.begin(), scan.returns.end(),
                        [](const Return& one) { return one.status == ReturnStatus::kOk; }));
    }
  };
  Frame frame;
  const auto end = Clock::now() + kStreamFor;
  while (Clock::now() < end) {
    ASSERT_EQ(source->next(frame, 2000ms), NextStatus::kFrame);
    ASSERT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
    take(scanner.process(frame));
    const std::int64_t now_ns = std::chrono::nanoseconds(Clock::now().time_since_epoch()).count();
    latencies_ms.push_back(
        1e-6 * static_cast<double>(now_ns - source->stream_statistics().last_completed_ns));
  }
  take(scanner.finish());
  const SourceStatistics got = source->statistics();
  const GigeStatistics network = source->stream_statistics();
  std::sort(latencies_ms.begin(), latencies_ms.end());
  RecordProperty("latency_p99_ms", std::to_string(latencies_ms[latencies_ms.size() * 99 / 100]));
  fmt::print(
      "{}: {} frames, {} scans, {} dropped, {} overrun, {} packets resent, {} thrown away "
      "by the kernel; last packet to scan p50 {:.2f} ms, p99 {:.2f} ms\n",
      name, got.delivered, scans, got.dropped, got.overrun, network.resent_packets,
      network.socket_drops, latencies_ms[latencies_ms.size() / 2],
      latencies_ms[latencies_ms.size() * 99 / 100]);
  EXPECT_EQ(got.dropped, 0u);
  EXPECT_EQ(got.overrun, 0u);
  EXPECT_EQ(scans, got.delivered);
  EXPECT_GT(static_cast<double>(good_returns), 0.9 * static_cast<double>(scans) * width);
  const double seconds = std::chrono::duration<double>(kStreamFor).count();
  EXPECT_GT(static_cast<double>(got.delivered), 0.95 * seconds * rate_hz);
}

INSTANTIATE_TEST_SUITE_P(Fast, GigeStream,
                         ::testing::Values(Traffic{"vga_200", 640, 480, 200.0},
                                           Traffic{"two_megapixels_60", 2048, 1088, 60.0}),
                         [](const auto& tried) { return std::string(tried.param.name); });

const cv::Size kPatternSize(320, 240);

VirtualStriper pattern_striper(double lost_packets) {
  VirtualCameraOptions options;
  options.lost_packets = lost_packets;
  return VirtualStriper(std::make_shared<PatternScene>(kPatternSize, 8, 200.0), options);
}

bool is_as_sent(const Frame& frame) {
  const cv::Mat sent =
      PatternScene::expected(kPatternSize, 8, frame.sequence, Illumination::laser(0));
  return cv::norm(frame.image, sent, cv::NORM_INF) == 0.0;
}

TEST(GigeResend, SavesEveryOneOfAThousandFramesAtOnePerMille) {
  const VirtualStriper striper = pattern_striper(0.001);
  const auto source = striper.open("packet_size=1400");
  source->start();
  Frame frame;
  for (int n = 0; n < 1000; ++n) {
    ASSERT_EQ(source->next(frame, 2000ms), NextStatus::kFrame);
    ASSERT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
    ASSERT_TRUE(is_as_sent(frame)) << "frame " << frame.sequence;
  }
  EXPECT_EQ(source->statistics().dropped, 0u);
  EXPECT_GT(source->stream_statistics().resent_packets, 0u);
}

class GigeLoss : public ::testing::TestWithParam<int> {};

TEST_P(GigeLoss, EveryFrameDeliveredIsExactAndTheOthersAreCounted) {
  for (const char* query : {"packet_size=1400", "packet_size=1400&resend=no"}) {
    const VirtualStriper striper = pattern_striper(1e-3 * GetParam());
    const auto source = striper.open(query);
    source->start();
    const TakenFrames taken = take_frames(*source, 300, is_as_sent);
    const SourceStatistics got = source->statistics();
    taken.expect_accounted_for(got);
    const GigeStatistics causes = source->stream_statistics();
    EXPECT_EQ(got.incomplete, causes.missing_packets + causes.timeouts + causes.aborted);
    EXPECT_EQ(got.corrupt + got.wrong_size, 0u);
    fmt::print(
        "loss {} per mille, {}: {} whole and exact; incomplete {}: {} missing packets, {} late; "
        "{} never began, {} packets asked for again, {} came\n",
        GetParam(), query, taken.whole, got.incomplete, causes.missing_packets, causes.timeouts,
        got.dropped, causes.resend_requests, causes.resent_packets);
  }
}

INSTANTIATE_TEST_SUITE_P(PerMille, GigeLoss, ::testing::Values(1, 10, 50));

int open_files() {
  DIR* const own = opendir("/proc/self/fd");
  int count = 0;
  while (readdir(own) != nullptr) ++count;
  closedir(own);
  return count;
}

double resident_mb() {
  std::ifstream file("/proc/self/statm");
  double all_pages = 0.0;
  double resident_pages = 0.0;
  file >> all_pages >> resident_pages;
  return resident_pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

/// That the client commanded every laser line off before anything else could light it, and that a
/// line is armed only for the acquisition's sake: from what the camera was written.
void expect_laser_off_until_acquisition(const detail::Device& camera) {
  const std::vector<RegisterWrite> writes = camera.register_writes();
  const auto is = [](const char* name) {
    return [name](const RegisterWrite& one) { return one.name == name; };
  };
  const auto first_source = std::find_if(writes.begin(), writes.end(), is("LineSource"));
  const auto begin = std::find_if(writes.begin(), writes.end(), is("AcquisitionStart"));
  ASSERT_NE(first_source, writes.end()) << "the laser's line was never commanded";
  EXPECT_EQ(first_source->value, 0u) << "the first command is not off";
  const auto first_armed = std::find_if(
      writes.begin(), writes.end(), [](const RegisterWrite& one) { return one.is_laser_armed; });
  EXPECT_LT(first_source, first_armed);
  const auto sequencer = std::find_if(writes.begin(), begin, is("SequencerConfigurationMode"));
  EXPECT_GE(first_armed, sequencer) << "armed by something else than the pattern";
}

TEST(GigeReconnection, TwentyTimesKilledAndStartedAgain) {
  VirtualStriper striper(std::make_shared<PatternScene>(cv::Size(160, 120), 8, 100.0));
  const auto source =
      striper.open("strobe=Line2&laser=0,dark&exposure_us=321&roi=16,8,64,32&gain=3&black_level=5");
  source->start();
  Frame frame;
  const auto check = [&](int frames) {
    for (int n = 0; n < frames;) {
      const NextStatus status = source->next(frame, 10s);
      ASSERT_EQ(status, NextStatus::kFrame);
      if (frame.status != FrameStatus::kOk) continue;
      ++n;
      const Illumination expected =
          frame.sequence % 2 == 0 ? Illumination::laser(0) : Illumination::dark();
      EXPECT_EQ(frame.illumination, expected) << "parity";
      EXPECT_EQ(frame.exposure_ns, 321'000);
      EXPECT_EQ(frame.grid, PixelGrid::region(16, 8));
      EXPECT_EQ(frame.image.size(), cv::Size(64, 32));
    }
  };
  check(10);
  int files_after_first = 0;
  double resident_before_mb = 0.0;
  for (std::uint64_t round = 1; round <= 20; ++round) {
    striper.pull_the_plug();
    std::this_thread::sleep_for(200ms);
    striper.plug_in();
    EXPECT_FALSE(striper.camera->statistics().is_laser_armed) << "a laser on before we opened it";
    // A late reader is first given what came before the plug was pulled.
    while (source->statistics().reconnects < round) ASSERT_NO_FATAL_FAILURE(check(1));
    ASSERT_NO_FATAL_FAILURE(check(6));
    EXPECT_EQ(source->statistics().reconnects, round);
    expect_laser_off_until_acquisition(*striper.camera);
    if (round == 2) files_after_first = open_files();
    if (round == 5) resident_before_mb = resident_mb();
  }
  EXPECT_LE(open_files(), files_after_first + 6) << "files are left open";
  const double grown_mb = resident_mb() - resident_before_mb;
  fmt::print("resident memory after 5 reconnections {:.2f} MB, after 20 {:+.2f} MB\n",
             resident_before_mb, grown_mb);
  if (kMeasuresMemory) {
    EXPECT_LT(grown_mb, 1.0) << "memory leaks";
  }
  EXPECT_EQ(source->stream_statistics().losses, 20u);
  source->stop();
  const std::vector<RegisterWrite> writes = striper.camera->register_writes();
  EXPECT_FALSE(writes.back().is_laser_armed);
  EXPECT_FALSE(striper.camera->statistics().is_laser_armed);
}

}  // namespace
}  // namespace striper::testing
