// SPDX-License-Identifier: Apache-2.0
// Proves what `sim:` addresses mean and how the simulated source behaves as a source. What is in
// the images is proved elsewhere.
#include <chrono>
#include <functional>
#include <thread>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>
#include <striper/simulator/simulated_source.hpp>

#include "support/error_of.hpp"
#include "support/shared_data.hpp"

namespace striper {
namespace {

using std::chrono::milliseconds;

std::string wall(const std::string& query) {
  return "sim:" + testing::source_path("data/scenes/wall.yaml").string() + query;
}

std::vector<Frame> all_frames(FrameSource& source) {
  std::vector<Frame> frames;
  source.start();
  Frame frame;
  while (source.next(frame, milliseconds(0)) == NextStatus::kFrame) frames.push_back(frame);
  for (Frame& kept : frames) kept.image = kept.image.clone();
  return frames;
}

std::string refusal(const std::string& uri, ErrorKind kind) {
  const Error error = testing::error_of([&] { open_source(uri); });
  EXPECT_EQ(error.kind(), kind);
  return error.what();
}

TEST(SimulatedSource, GivesTheNumberOfFramesThatIsAskedFor) {
  const auto source = open_source(wall("?frames=3&fps=20"));
  EXPECT_EQ(source->info().pictures, 3U);
  EXPECT_EQ(source->info().image_size, cv::Size(640, 480));
  EXPECT_EQ(source->info().picture_rate_hz, 20.0);
  EXPECT_EQ(source->info().pattern, IlluminationPattern::parse("0"));
  Frame frame;
  EXPECT_EQ(source->next(frame, milliseconds(0)), NextStatus::kStopped);
  const std::vector<Frame> frames = all_frames(*source);
  ASSERT_EQ(frames.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(frames[i].sequence, i);
    EXPECT_EQ(frames[i].time.monotonic_ns, static_cast<std::int64_t>(i) * 50'000'000);
    EXPECT_EQ(frames[i].illumination, Illumination::laser(0));
    EXPECT_EQ(frames[i].status, FrameStatus::kOk);
  }
  EXPECT_EQ(source->statistics().delivered, 3U);
  EXPECT_EQ(source->next(frame, milliseconds(0)), NextStatus::kEnd);
}

TEST(SimulatedSource, StartsAgainFromTheFirstFrame) {
  const auto source = open_source(wall("?frames=2"));
  const std::vector<Frame> first = all_frames(*source);
  source->stop();
  Frame frame;
  EXPECT_EQ(source->next(frame, milliseconds(0)), NextStatus::kStopped);
  const std::vector<Frame> second = all_frames(*source);
  ASSERT_EQ(second.size(), 2U);
  EXPECT_EQ(cv::norm(first[1].image, second[1].image, cv::NORM_INF), 0.0);
  EXPECT_NE(cv::norm(first[0].image, first[1].image, cv::NORM_INF), 0.0);
}

TEST(SimulatedSource, FramesHandedOutStayAsTheyAre) {
  const auto source = open_source(wall(""));
  source->start();
  Frame first;
  Frame second;
  ASSERT_EQ(source->next(first, milliseconds(0)), NextStatus::kFrame);
  const cv::Mat copy = first.image.clone();
  ASSERT_EQ(source->next(second, milliseconds(0)), NextStatus::kFrame);
  EXPECT_EQ(cv::norm(first.image, copy, cv::NORM_INF), 0.0);
}

TEST(SimulatedSource, NoiseCanBeSwitchedOffWhollyOrByName) {
  const auto quiet = all_frames(*open_source(wall("?frames=2&noise=off")));
  EXPECT_EQ(cv::norm(quiet[0].image, quiet[1].image, cv::NORM_INF), 0.0);
  const auto read = all_frames(*open_source(wall("?frames=2&noise=read")));
  EXPECT_NE(cv::norm(read[0].image, read[1].image, cv::NORM_INF), 0.0);
  const auto other = all_frames(*open_source(wall("?frames=2&noise=read&seed=9")));
  EXPECT_NE(cv::norm(read[0].image, other[0].image, cv::NORM_INF), 0.0);
}

TEST(SimulatedSource, LasersFollowThePatternOfTheAddress) {
  const auto source = open_source(wall("?frames=4&laser=0,dark"));
  EXPECT_EQ(source->info().pattern, IlluminationPattern::parse("0,dark"));
  const auto frames = all_frames(*source);
  EXPECT_TRUE(frames[0].illumination.is_lit());
  EXPECT_TRUE(frames[1].illumination.is_dark());
  EXPECT_GT(cv::norm(frames[0].image, frames[1].image, cv::NORM_INF), 50.0);
}

TEST(SimulatedSource, IlluminationCanBeKeptSecret) {
  const auto secret = open_source(wall("?frames=2&illumination=unknown"));
  EXPECT_TRUE(secret->info().pattern.is_automatic());
  EXPECT_TRUE(all_frames(*secret)[0].illumination.is_unknown());
  // What the address says is no secret.
  const auto told = open_source(wall("?frames=2&illumination=unknown&laser=0,dark"));
  EXPECT_EQ(told->info().pattern, IlluminationPattern::parse("0,dark"));
}

TEST(SimulatedSource, FieldsAreInterlacedOrOneByOne) {
  const auto interlaced = open_source(wall("?frames=2&fields=split-bottom"));
  EXPECT_EQ(interlaced->info().field, Field::kInterlacedBottomFirst);
  EXPECT_EQ(all_frames(*interlaced).size(), 2U);
  const auto by_field = open_source(wall("?frames=2&fields=alternate-top"));
  EXPECT_EQ(by_field->info().field, Field::kTop);
  const auto frames = all_frames(*by_field);
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_EQ(frames[0].field, Field::kTop);
  EXPECT_EQ(frames[1].field, Field::kBottom);
  EXPECT_EQ(frames[3].exposure_number(), 3U);
  EXPECT_EQ(frames[3].image.rows, 240);
}

TEST(SimulatedSource, RealTimeWaitsUntilAFrameIsDue) {
  const auto source = open_source(wall("?frames=3&fps=4&realtime=yes"));
  source->start();
  const auto begin = std::chrono::steady_clock::now();
  Frame frame;
  for (int n = 0; n < 3; ++n) {
    EXPECT_EQ(source->next(frame, milliseconds(1000)), NextStatus::kFrame);
  }
  EXPECT_GE(std::chrono::steady_clock::now() - begin, milliseconds(500));
}

// Who waits for the next frame hears of a Ctrl-C meanwhile, and misses nothing.
TEST(SimulatedSource, RealTimeTimesOutBeforeAFrameIsDue) {
  const auto source = open_source(wall("?frames=2&fps=0.25&realtime=yes"));
  source->start();
  Frame frame;
  int timeouts = 0;
  for (std::uint64_t n = 0; n < 2; ++n) {
    NextStatus status = NextStatus::kTimeout;
    while ((status = source->next(frame, milliseconds(20))) == NextStatus::kTimeout) ++timeouts;
    ASSERT_EQ(status, NextStatus::kFrame);
    EXPECT_EQ(frame.sequence, n);
  }
  EXPECT_GE(timeouts, 3);
}

TEST(SimulatedSource, StopEndsTheWaitForAFrame) {
  const auto source = open_source(wall("?fps=0.01&realtime=yes"));
  source->start();
  Frame frame;
  ASSERT_EQ(source->next(frame, milliseconds(1000)), NextStatus::kFrame);
  std::thread stopper([&source] {
    std::this_thread::sleep_for(milliseconds(50));
    source->stop();
  });
  EXPECT_EQ(source->next(frame, milliseconds(60000)), NextStatus::kStopped);
  stopper.join();
}

TEST(SimulatedSource, WhatIsWrongInTheAddressIsRefusedByName) {
  EXPECT_EQ(refusal(wall("?noise=loud"), ErrorKind::kUsage),
            "source '" + wall("?noise=loud") +
                "': noise=loud - expected off, or those to keep of shot, read, prnu, speckle");
  EXPECT_EQ(refusal(wall("?frame=3"), ErrorKind::kUsage),
            "source '" + wall("?frame=3") +
                "': unknown key 'frame'; sim: knows frames, fps, seed, noise, laser, illumination, "
                "fields, realtime, encoder, encoder_bits");
  EXPECT_EQ(refusal(wall("?laser=3"), ErrorKind::kUsage),
            "source '" + wall("?laser=3") +
                "': timing.cadence: '3' - expected laser indices below 1, the number of lasers");
  EXPECT_EQ(
      refusal("sim:no/such/scene.yaml", ErrorKind::kNotFound),
      "no/such/scene.yaml: there is no such file - expected a scene; some to start from are in "
      "data/scenes/");
}

}  // namespace
}  // namespace striper
