// SPDX-License-Identifier: Apache-2.0
// Proves, with the virtual camera over real packets on loopback, that frames arrive bit for bit
// in every format and region, that frames say what lit them, that the laser is off whenever it must
// be, that lost packets are asked for again, and that a camera's clock is tracked. Does not prove
// that a camera of a particular maker behaves like ours.
#include <chrono>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/core/error.hpp>

#include "capture/gige/virtual_striper.hpp"
#include "live/host_clock.hpp"
#include "support/error_of.hpp"
#include "support/heard.hpp"

namespace striper::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::Not;

const cv::Size kSize(160, 120);

std::shared_ptr<PatternScene> pattern(int bit_depth = 8, double rate_hz = 100.0) {
  return std::make_shared<PatternScene>(kSize, bit_depth, rate_hz);
}

bool is_same(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

/// Frames until one of `count` has come, each whole.
std::vector<Frame> take(FrameSource& source, int count) {
  std::vector<Frame> frames;
  Frame frame;
  while (static_cast<int>(frames.size()) < count &&
         source.next(frame, 2000ms) == NextStatus::kFrame) {
    Frame own = frame;
    own.image = frame.image.clone();
    own.lease.reset();
    frames.push_back(own);
  }
  EXPECT_EQ(static_cast<int>(frames.size()), count);
  return frames;
}

std::string refusal(const VirtualStriper& striper, const std::string& query) {
  return error_of([&] { striper.open(query); }).what();
}

struct Format {
  const char* name;
  int bit_depth;
};

void PrintTo(const Format& format, std::ostream* out) { *out << format.name; }

class GigeFormats : public ::testing::TestWithParam<Format> {};

TEST_P(GigeFormats, ArriveBitForBitWithAndWithoutARegion) {
  const auto [name, bits] = GetParam();
  const VirtualStriper striper(pattern(bits));
  for (const cv::Rect region : {cv::Rect(0, 0, 160, 120), cv::Rect(8, 13, 64, 50)}) {
    const auto source = striper.open(fmt::format("pixel_format={}&roi={},{},{},{}", name, region.x,
                                                 region.y, region.width, region.height));
    EXPECT_EQ(source->info().bit_depth, bits);
    source->start();
    for (const Frame& frame : take(*source, 5)) {
      ASSERT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
      EXPECT_EQ(frame.sensor_size, kSize);
      EXPECT_EQ(frame.grid, PixelGrid::region(region.x, region.y));
      const cv::Mat truth =
          PatternScene::expected(kSize, bits, frame.sequence, Illumination::laser(0))(region);
      EXPECT_TRUE(is_same(frame.image, truth)) << name << " frame " << frame.sequence;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, GigeFormats,
                         ::testing::Values(Format{"Mono8", 8}, Format{"Mono10", 10},
                                           Format{"Mono10Packed", 10}, Format{"Mono10p", 10},
                                           Format{"Mono12", 12}, Format{"Mono12Packed", 12},
                                           Format{"Mono12p", 12}, Format{"Mono14", 14},
                                           Format{"Mono16", 16}),
                         [](const auto& tried) { return std::string(tried.param.name); });

TEST(GigeSource, BinnedFramesHaveTheGridOfTheirBins) {
  const VirtualStriper striper(pattern());
  const auto source = striper.open("binning=2&roi=4,6,32,16");
  source->start();
  const Frame frame = take(*source, 1).front();
  EXPECT_EQ(frame.image.size(), cv::Size(32, 16));
  EXPECT_EQ(frame.grid, PixelGrid::binned(2, 2).then(PixelGrid::region(4, 6)));
  EXPECT_EQ(frame.sensor_size, kSize);
}

TEST(GigeSource, IsFoundBySerialMacNameAndAddress) {
  VirtualCameraOptions options;
  options.user_name = fmt::format("bench-{}", getpid() % 10000);
  const VirtualStriper striper(pattern(), options);
  for (const std::string& name : {striper.options.serial, striper.options.user_name,
                                  striper.options.address, "Striper-" + striper.options.serial}) {
    EXPECT_THAT(open_source("gige:" + name)->info().description, HasSubstr(striper.options.serial))
        << name;
  }
}

// All of USB3 Vision that can be tried without such a camera.
TEST(GigeSource, AUsbCameraThatIsNotThereIsLookedForAndRefused) {
  const Error error =
      error_of([] { GigeSource(GigeOptions::from_uri(SourceUri::parse("u3v:NOBODY"))); });
  EXPECT_EQ(error.kind(), ErrorKind::kNotFound);
  EXPECT_THAT(error.what(), HasSubstr("'u3v:NOBODY': no such USB3 Vision camera; there "));
}

std::vector<Event> events_when_opened_with(const std::string& query) {
  const VirtualStriper striper(pattern());
  const Heard heard;
  striper.open(query, heard.port());
  return heard.events();
}

TEST(GigeSource, PatternWithoutALineToSwitchIsExplained) {
  EXPECT_THAT(events_when_opened_with("laser=0,dark"), has_event("laser_not_switched"));
  EXPECT_THAT(events_when_opened_with("laser=0"), Not(has_event("laser_not_switched")));
  EXPECT_THAT(events_when_opened_with("trigger=Line1&laser=0,dark"),
              Not(has_event("laser_not_switched")))
      << "who fires the trigger fires the laser";
  EXPECT_THAT(events_when_opened_with("strobe=Line2&laser=0,dark"),
              Not(has_event("laser_not_switched")));
}

TEST(GigeSource, FieldsOfACameraOfWholeFramesAreExplained) {
  EXPECT_THAT(events_when_opened_with("fields=split-top"), has_event("setting_unlikely"));
  EXPECT_THAT(events_when_opened_with(""), Not(has_event("setting_unlikely")));
}

TEST(GigeSource, ASecondProgramIsToldThatTheCameraIsBusy) {
  const VirtualStriper striper(pattern());
  const auto source = striper.open();
  EXPECT_THAT(refusal(striper, "fps=5"), HasSubstr("busy"));
}

TEST(GigeSource, WhatTheCameraDoesNotTakeIsRefusedWithWhatItDoes) {
  const VirtualStriper striper(pattern());
  EXPECT_THAT(refusal(striper, "exposure_us=2e6"),
              HasSubstr("ExposureTime=2000000 - expected 1 to 1000000"));
  EXPECT_THAT(refusal(striper, "roi=0,0,50,20"),
              HasSubstr("Width=50 - expected 4 to 160 in steps"));
  EXPECT_THAT(refusal(striper, "roi=0,0,400,20"), HasSubstr("Width=400 - expected 4 to 160"));
  EXPECT_THAT(refusal(striper, "roi=100,0,100,20"), HasSubstr("OffsetX=100 - expected 0 to 60"));
  EXPECT_THAT(refusal(striper, "pixel_format=BayerRG8"),
              HasSubstr("PixelFormat=BayerRG8 - expected"));
  EXPECT_THAT(refusal(striper, "pixel_format=Mono9"), HasSubstr("expected one of Mono8"));
  EXPECT_THAT(refusal(striper, "strobe=Line9"), HasSubstr("LineSelector=Line9 - expected one of"));
  EXPECT_THAT(refusal(striper, "strobe=Line1"),
              HasSubstr("strobe=Line1 - this line cannot be an output; outputs are Line2, Line3"));
  EXPECT_THAT(refusal(striper, "packet_size=9"),
              HasSubstr("packet_size=9 - the camera allows 576 to 16000"));
  EXPECT_THAT(refusal(striper, "packet_size=20000"), HasSubstr("allows 576 to 16000"));
  EXPECT_THAT(refusal(striper, "trigger=Line7"),
              HasSubstr("TriggerSource=Line7 - expected one of"));
  EXPECT_THAT(refusal(striper, "Wibble=1"), HasSubstr("no feature 'Wibble'"));
  EXPECT_THAT(refusal(striper, "BlackLevel=1000"),
              HasSubstr("BlackLevel=1000 - expected 0 to 255"));
  EXPECT_THAT(refusal(striper, "BlackLevel=x"), HasSubstr("BlackLevel=x - expected a number"));
}

/// A frame takes 0.84 s. The shorter time is over before that, so the next trigger goes first.
class SlowFrame : public ::testing::TestWithParam<int> {};

TEST_P(SlowFrame, HasTheLightThatWasCommandedForIt) {
  VirtualCameraOptions options;
  detail::CameraFaults faults;
  faults.lacking = {"ChunkModeActive"};
  options.link_mbit_s = 10.0;
  const cv::Size size(1024, 1024);
  const VirtualStriper striper(std::make_shared<PatternScene>(size, 8, 200.0), options, faults);
  const auto source = open_source(
      fmt::format("gige:{}?frame_timeout_ms={}&exposure_us=300&strobe=Line2&laser=0,dark,dark&"
                  "switching=host",
                  striper.options.address, GetParam()));
  source->start();
  Frame frame;
  for (std::uint64_t n = 0; n < 4; ++n) {
    ASSERT_EQ(source->next(frame, 5000ms), NextStatus::kFrame);
    ASSERT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
    EXPECT_EQ(frame.sequence, n);
    const Illumination light = n % 3 == 0 ? Illumination::laser(0) : Illumination::dark();
    EXPECT_EQ(frame.illumination, light) << "of frame " << n;
    EXPECT_EQ(cv::norm(frame.image, PatternScene::expected(size, 8, n, light), cv::NORM_INF), 0.0)
        << "of frame " << n;
  }
}

INSTANTIATE_TEST_SUITE_P(FrameTimeout_ms, SlowFrame, ::testing::Values(200, 400));

struct Switching {
  const char* name;
  std::set<std::string> lacking;
  const char* query;
};

void PrintTo(const Switching& switching, std::ostream* out) { *out << switching.name; }

class GigeLaser : public ::testing::TestWithParam<Switching> {};

TEST_P(GigeLaser, FramesSayWhatReallyLitThem) {
  detail::CameraFaults faults;
  faults.lacking = GetParam().lacking;
  const VirtualStriper striper(pattern(), {}, faults);
  const auto source =
      striper.open(std::string("strobe=Line2&laser=0,dark&fps=100&") + GetParam().query);
  source->start();
  for (const Frame& frame : take(*source, 16)) {
    EXPECT_EQ(frame.illumination,
              frame.sequence % 2 == 0 ? Illumination::laser(0) : Illumination::dark());
    const cv::Mat truth = PatternScene::expected(kSize, 8, frame.sequence, frame.illumination);
    EXPECT_TRUE(is_same(frame.image, truth)) << "frame " << frame.sequence;
  }
  EXPECT_EQ(source->info().pattern, IlluminationPattern::parse("0,dark"));
}

INSTANTIATE_TEST_SUITE_P(
    Ways, GigeLaser,
    ::testing::Values(Switching{"sequencer_with_line_chunk", {}, "switching=auto"},
                      Switching{"sequencer_alone", {"ChunkModeActive"}, "switching=sequencer"},
                      Switching{"host_with_line_chunk", {}, "switching=host"},
                      Switching{"host_alone",
                                {"ChunkModeActive", "SequencerMode", "SequencerConfigurationMode"},
                                "switching=auto"},
                      // Many cameras' lines know no Off: a user output that is low does as well.
                      Switching{"sequencer_with_user_output", {"LineSource.Off"}, ""},
                      Switching{"host_with_user_output", {"LineSource.Off"}, "switching=host"}),
    [](const auto& tried) { return std::string(tried.param.name); });

TEST(GigeSource, TheLaserIsOffWheneverNothingStreams) {
  const VirtualStriper striper(pattern());
  for (const char* query :
       {"strobe=Line2", "strobe=Line2&laser=0,dark", "strobe=Line2&laser=0,dark&switching=host"}) {
    const auto is_armed = [&] { return striper.camera->statistics().is_laser_armed; };
    auto source = striper.open(query);
    EXPECT_FALSE(is_armed()) << "opened, " << query;
    source->start();
    take(*source, 3);
    source->stop();
    EXPECT_FALSE(is_armed()) << "stopped, " << query;
    source->start();
    take(*source, 3);
    source.reset();
    EXPECT_FALSE(is_armed()) << "destroyed while streaming, " << query;
  }
}

TEST(GigeSource, TheLaserIsOffWhenOpeningFailsHalfWay) {
  const VirtualStriper striper(pattern());
  EXPECT_THAT(refusal(striper, "strobe=Line2&exposure_us=2e6"), HasSubstr("ExposureTime"));
  EXPECT_FALSE(striper.camera->statistics().is_laser_armed);
  EXPECT_FALSE(striper.camera->statistics().is_controlled);
}

TEST(GigeSource, SoftwareTriggersTakeFrames) {
  const VirtualStriper striper(pattern());
  const auto source = striper.open("trigger=software&fps=50");
  source->start();
  std::uint64_t expected = 0;
  for (const Frame& frame : take(*source, 8)) EXPECT_EQ(frame.sequence, expected++);
}

TEST(GigeSource, LostPacketsAreAskedForAgain) {
  VirtualCameraOptions options;
  options.lost_packets = 0.01;
  const VirtualStriper striper(pattern(8, 200.0), options);
  const auto source = striper.open("packet_size=1400");
  source->start();
  for (const Frame& frame : take(*source, 200)) {
    ASSERT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
    EXPECT_TRUE(is_same(frame.image,
                        PatternScene::expected(kSize, 8, frame.sequence, Illumination::laser(0))));
  }
  EXPECT_EQ(source->statistics().dropped, 0u);
  const std::uint64_t resent = source->stream_statistics().resent_packets;
  EXPECT_GT(resent, 0u);
  source->stop();
  EXPECT_GE(source->stream_statistics().resent_packets, resent) << "kept when the stream is gone";
}

TEST(GigeSource, WithoutResendBrokenFramesAreCountedAndNeverUsed) {
  VirtualCameraOptions options;
  options.lost_packets = 0.05;
  const VirtualStriper striper(pattern(8, 200.0), options);
  const auto source = striper.open("packet_size=1400&resend=no");
  source->start();
  int whole = 0;
  const std::vector<Frame> frames = take(*source, 100);
  for (const Frame& frame : frames) {
    if (frame.status == FrameStatus::kOk) {
      ++whole;
      EXPECT_TRUE(is_same(
          frame.image, PatternScene::expected(kSize, 8, frame.sequence, Illumination::laser(0))));
    } else {
      EXPECT_EQ(frame.status, FrameStatus::kIncomplete);
      EXPECT_TRUE(frame.image.empty());
      EXPECT_FALSE(frame.status_detail.empty());
    }
  }
  const SourceStatistics statistics = source->statistics();
  const GigeStatistics causes = source->stream_statistics();
  EXPECT_GT(whole, 10);
  EXPECT_LT(whole, 90);
  EXPECT_EQ(statistics.incomplete, 100u - static_cast<unsigned>(whole));
  EXPECT_EQ(causes.missing_packets + causes.timeouts, statistics.incomplete);
  EXPECT_EQ(frames.back().sequence + 1, 100u + statistics.dropped);
}

TEST(GigeSource, ASkewedCameraClockIsFollowed) {
  VirtualCameraOptions options;
  detail::CameraFaults faults;
  options.clock_skew = 2e-4;
  faults.clock_offset_ns = 123'456'789'012;
  const VirtualStriper striper(pattern(8, 100.0), options, faults);
  const auto source = striper.open("exposure_us=1000");
  source->start();
  // Until the rate is known: on a busy machine many comparisons of the clocks are too vague to use.
  const double truth = 1.0 / (1.0 + options.clock_skew);
  const auto end = std::chrono::steady_clock::now() + 20s;
  const auto error = [&] { return std::abs(source->stream_statistics().clock_rate - truth); };
  Frame frame;
  std::int64_t last_ns = 0;
  while (error() > 5e-5 && std::chrono::steady_clock::now() < end) {
    ASSERT_EQ(source->next(frame, 2000ms), NextStatus::kFrame);
    EXPECT_GT(frame.time.monotonic_ns, last_ns);
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    EXPECT_LT(frame.time.monotonic_ns, std::chrono::nanoseconds(now).count());
    EXPECT_GT(frame.time.monotonic_ns, std::chrono::nanoseconds(now - 2s).count());
    last_ns = frame.time.monotonic_ns;
  }
  EXPECT_LT(error(), 5e-5);
}

TEST(GigeSource, TimesOfDayArePtpsWhileTheCameraFollowsIt) {
  constexpr std::int64_t kAhead_ns = 150'000'000;  // of the network's time before this host's
  for (const std::set<std::string>& lacking :
       {std::set<std::string>{}, std::set<std::string>{"PtpEnable", "PtpStatus"}}) {
    detail::CameraFaults faults;
    faults.lacking = lacking;  // the second one has GevIEEE1588, as it was called before
    faults.ptp_offset_ns = kAhead_ns;
    const VirtualStriper striper(pattern(8, 100.0), {}, faults);
    const auto source = striper.open("ptp=yes&exposure_us=1000");
    source->start();
    const auto ahead_of_host_ns = [](const Frame& frame) {
      return *frame.time.utc_offset_ns - detail::utc_offset_now_ns();
    };
    const auto end = std::chrono::steady_clock::now() + 10s;
    Frame frame;
    std::int64_t last_ns = 0;
    do {
      ASSERT_EQ(source->next(frame, 2000ms), NextStatus::kFrame);
      EXPECT_GT(frame.time.monotonic_ns, last_ns - 2'000'000) << "the step into PTP is not seen";
      last_ns = frame.time.monotonic_ns;
    } while (ahead_of_host_ns(frame) < kAhead_ns / 2 && std::chrono::steady_clock::now() < end);
    // A busy host compares the clocks a millisecond late now and then.
    for (const Frame& one : take(*source, 5)) {
      EXPECT_NEAR(static_cast<double>(ahead_of_host_ns(one)), kAhead_ns, 5e6);
    }
  }
}

TEST(GigeSource, AReaderThatSleepsLosesTheOldestFrames) {
  const VirtualStriper striper(pattern(8, 200.0));
  const auto source = striper.open("buffers=6");
  source->start();
  take(*source, 1);
  std::this_thread::sleep_for(300ms);
  const std::vector<Frame> frames = take(*source, 10);
  EXPECT_GT(frames.front().sequence, 20u);
  const SourceStatistics statistics = source->statistics();
  EXPECT_GT(statistics.overrun, 20u);
  EXPECT_EQ(frames.back().sequence + 1,
            statistics.delivered + statistics.dropped + statistics.overrun);
}

TEST(GigeSource, WhatWasLeftUnreadIsForgottenWhenItStartsAgain) {
  const VirtualStriper striper(pattern());
  const auto source = striper.open("buffers=4&fps=100");
  source->start();
  take(*source, 2);
  std::this_thread::sleep_for(200ms);
  EXPECT_GT(source->statistics().overrun, 0U);
  source->stop();
  source->start();
  const std::vector<Frame> again = take(*source, 3);
  EXPECT_EQ(again.front().sequence, 0U);
  EXPECT_EQ(again.back().sequence, 2U);
  EXPECT_EQ(source->statistics().overrun, 0U);
}

TEST(GigeSource, OnlyPacketsThatGetThroughAreAgreedOn) {
  VirtualCameraOptions options;
  options.mtu = 1500;
  const VirtualStriper striper(pattern(), options);
  const auto source = striper.open();
  source->start();
  EXPECT_EQ(take(*source, 3).back().status, FrameStatus::kOk);
  const int agreed = source->stream_statistics().packet_bytes;
  EXPECT_LE(agreed, 1500);
  EXPECT_GT(agreed, 1300);
}

TEST(GigeSource, ACameraThatWasForgottenIsOpenedAgain) {
  const VirtualStriper striper(pattern());
  const auto source = striper.open("strobe=Line2&laser=0,dark&exposure_us=300");
  source->start();
  const std::uint64_t before = take(*source, 5).back().sequence;
  striper.camera->forget_controller();
  const auto lost_at = std::chrono::steady_clock::now();
  Frame frame;
  while (source->statistics().reconnects == 0 && std::chrono::steady_clock::now() - lost_at < 5s) {
    source->next(frame, 50ms);
  }
  EXPECT_EQ(source->statistics().reconnects, 1u);
  const std::vector<Frame> after = take(*source, 6);
  for (const Frame& one : after) {
    EXPECT_GT(one.sequence, before);
    EXPECT_EQ(one.exposure_ns, 300'000);
    EXPECT_EQ(one.illumination,
              one.sequence % 2 == 0 ? Illumination::laser(0) : Illumination::dark());
  }
}

}  // namespace
}  // namespace striper::testing
