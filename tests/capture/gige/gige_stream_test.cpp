// SPDX-License-Identifier: Apache-2.0
// Proves over real packets on loopback that fast streams become scans without a picture lost, that
// resend saves whole streams, and that a camera which is killed and started again twenty times is
// opened again every time, with its settings, its laser in step and nothing left behind. The camera
// and the reader share one machine, so this says little about network cards.
#include <algorithm>
#include <chrono>
#include <thread>
#include <vector>

#include <dirent.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/pipeline/scanner.hpp>

#include "capture/gige/virtual_striper.hpp"

namespace striper::testing {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

#ifdef STRIPER_SOAK
constexpr auto kStreamFor = 60s;
#else
constexpr auto kStreamFor = 20s;
#endif

struct Stream {
  const char* name;
  int width;
  int height;
  double rate_hz;
};

class GigeStream : public ::testing::TestWithParam<Stream> {};

TEST_P(GigeStream, BecomesScansWithoutLoss) {
  const auto [name, width, height, rate_hz] = GetParam();
  VirtualCameraOptions options;
  options.link_mbit_s = 10000.0;
  const VirtualStriper striper(
      make_looped_scene(std::make_shared<PatternScene>(cv::Size(width, height), 8, rate_hz), 2),
      options);
  const auto source = striper.open(fmt::format("fps={}&exposure_us=20", rate_hz));
  Scanner scanner{ScannerOptions{}};
  source->start();
  std::vector<double> latencies_ms;
  std::uint64_t scans = 0;
  Frame frame;
  const auto end = Clock::now() + kStreamFor;
  while (Clock::now() < end) {
    ASSERT_EQ(source->next(frame, 2000ms), NextStatus::kFrame);
    ASSERT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
    scans += scanner.process(frame).size();
    const std::int64_t now_ns = std::chrono::nanoseconds(Clock::now().time_since_epoch()).count();
    latencies_ms.push_back(
        1e-6 * static_cast<double>(now_ns - source->stream_statistics().last_completed_ns));
  }
  scans += scanner.finish().size();
  const SourceStatistics got = source->statistics();
  const GigeStatistics network = source->stream_statistics();
  std::sort(latencies_ms.begin(), latencies_ms.end());
  RecordProperty("latency_p99_ms", std::to_string(latencies_ms[latencies_ms.size() * 99 / 100]));
  fmt::print(
      "{}: {} pictures, {} scans, {} dropped, {} overrun, {} packets resent, {} thrown away "
      "by the kernel; last packet to scan p50 {:.2f} ms, p99 {:.2f} ms\n",
      name, got.delivered, scans, got.dropped, got.overrun, network.resent_packets,
      network.socket_drops, latencies_ms[latencies_ms.size() / 2],
      latencies_ms[latencies_ms.size() * 99 / 100]);
  EXPECT_EQ(got.dropped, 0u);
  EXPECT_EQ(got.overrun, 0u);
  EXPECT_EQ(scans, got.delivered);
  const double seconds = std::chrono::duration<double>(kStreamFor).count();
  EXPECT_GT(static_cast<double>(got.delivered), 0.95 * seconds * rate_hz);
}

INSTANTIATE_TEST_SUITE_P(Fast, GigeStream,
                         ::testing::Values(Stream{"vga_200", 640, 480, 200.0},
                                           Stream{"two_megapixels_60", 2048, 1088, 60.0}),
                         [](const auto& tried) { return std::string(tried.param.name); });

TEST(GigeResend, SavesEveryOneOfAThousandPicturesAtOnePerMille) {
  VirtualCameraOptions options;
  options.lost_packets = 0.001;
  const VirtualStriper striper(std::make_shared<PatternScene>(cv::Size(320, 240), 8, 200.0),
                               options);
  const auto source = striper.open("packet_size=1400");
  source->start();
  Frame frame;
  for (int n = 0; n < 1000; ++n) {
    ASSERT_EQ(source->next(frame, 2000ms), NextStatus::kFrame);
    ASSERT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
    const cv::Mat truth =
        PatternScene::expected(cv::Size(320, 240), 8, frame.sequence, Illumination::laser(0));
    ASSERT_EQ(cv::norm(frame.image, truth, cv::NORM_INF), 0.0) << "picture " << frame.sequence;
  }
  EXPECT_EQ(source->statistics().dropped, 0u);
  EXPECT_GT(source->stream_statistics().resent_packets, 0u);
}

class GigeLoss : public ::testing::TestWithParam<int> {};

TEST_P(GigeLoss, EveryPictureDeliveredIsExactAndTheOthersAreCounted) {
  VirtualCameraOptions options;
  options.lost_packets = 1e-3 * GetParam();
  for (const char* query : {"packet_size=1400", "packet_size=1400&resend=no"}) {
    const VirtualStriper striper(std::make_shared<PatternScene>(cv::Size(320, 240), 8, 200.0),
                                 options);
    const auto source = striper.open(query);
    source->start();
    Frame frame;
    std::uint64_t last = 0;
    for (int n = 0; n < 300; ++n) {
      ASSERT_EQ(source->next(frame, 2000ms), NextStatus::kFrame);
      last = frame.sequence;
      if (frame.status != FrameStatus::kOk) continue;
      const cv::Mat truth =
          PatternScene::expected(cv::Size(320, 240), 8, frame.sequence, Illumination::laser(0));
      ASSERT_EQ(cv::norm(frame.image, truth, cv::NORM_INF), 0.0) << "picture " << frame.sequence;
    }
    const SourceStatistics got = source->statistics();
    EXPECT_EQ(last + 1, got.delivered + got.dropped + got.overrun);
    fmt::print("loss {} per mille, {}: {} delivered, {} incomplete, {} dropped\n", GetParam(),
               query, got.delivered, got.incomplete, got.dropped);
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

TEST(GigeReconnection, TwentyTimesKilledAndStartedAgain) {
  VirtualStriper striper(std::make_shared<PatternScene>(cv::Size(160, 120), 8, 100.0));
  const auto source = striper.open("strobe=Line2&laser=0,dark&exposure_us=321&roi=16,8,64,32");
  source->start();
  Frame frame;
  const auto check = [&](int pictures) {
    for (int n = 0; n < pictures;) {
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
  for (std::uint64_t round = 1; round <= 20; ++round) {
    striper.pull_the_plug();
    std::this_thread::sleep_for(200ms);
    striper.plug_in();
    EXPECT_FALSE(striper.camera->statistics().is_laser_armed) << "a laser on before we opened it";
    check(6);
    EXPECT_EQ(source->statistics().reconnects, round);
    if (round == 2) files_after_first = open_files();
  }
  EXPECT_LE(open_files(), files_after_first + 6) << "files are left open";
  source->stop();
  EXPECT_FALSE(striper.camera->statistics().is_laser_armed);
}

}  // namespace
}  // namespace striper::testing
