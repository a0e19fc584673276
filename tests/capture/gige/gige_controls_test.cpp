// SPDX-License-Identifier: Apache-2.0
// Proves, with the virtual camera and its packets, that what is set while a camera streams reaches
// it and is what the frames then say, that a laser switched off stays off through a stop and a
// loss, and that an encoder's counts come with the frame they belong to.
#include <chrono>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/gige/virtual_striper.hpp"
#include "support/error_of.hpp"

namespace striper {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::PatternScene;
using testing::VirtualStriper;

std::shared_ptr<VirtualScene> pattern() {
  return std::make_shared<PatternScene>(cv::Size(160, 120), 8, 100.0);
}

Frame next(FrameSource& source) {
  Frame frame;
  EXPECT_EQ(source.next(frame, std::chrono::seconds(5)), NextStatus::kFrame);
  return frame;
}

// Whether it comes to hold, for this frame or one of the next.
template <typename Condition>
bool soon(FrameSource& source, Condition condition) {
  constexpr int kFrames = 60;  // What is on its way when a control is set.
  for (int i = 0; i < kFrames; ++i) {
    if (condition(next(source))) return true;
  }
  return false;
}

TEST(GigeControls, ExposureAndGainReachTheCameraWhileItStreams) {
  const VirtualStriper striper(pattern());
  const auto source = striper.open("fps=100&exposure_us=200");
  source->start();
  EXPECT_EQ(next(*source).exposure_ns, 200'000);
  EXPECT_THAT(source->controls().set("exposure_us", {500.0}).state.value, ElementsAre(500.0));
  EXPECT_TRUE(soon(*source, [](const Frame& frame) { return frame.exposure_ns == 500'000; }));
  EXPECT_THAT(source->controls().set("gain_db", {6.0}).state.value, ElementsAre(6.0));
  std::string written;
  for (const RegisterWrite& one : striper.camera->register_writes()) written += one.name + " ";
  EXPECT_THAT(written, HasSubstr("ExposureTime"));
  EXPECT_THAT(written, HasSubstr("Gain"));
  const Error error = testing::error_of([&] { source->controls().set("exposure_us", {2e6}); });
  EXPECT_EQ(error.kind(), ErrorKind::kBadValue);
  EXPECT_THAT(error.what(), HasSubstr("exposure_us=2000000 - expected 1 to 1000000 us"));
  EXPECT_THAT(source->controls().get("region").state.value, ElementsAre(0, 0, 160, 120));
  // No line of the camera fires a laser.
  EXPECT_EQ(testing::error_of([&] { source->controls().get("laser"); }).kind(), ErrorKind::kUsage);
}

TEST(GigeControls, LaserIsSwitchedHoweverItFollowsItsPattern) {
  const VirtualStriper striper(pattern());
  for (const char* const query :
       {"fps=100&strobe=Line2&laser=0", "fps=100&strobe=Line2&laser=0,dark",
        "fps=50&strobe=Line2&laser=0,dark&switching=host"}) {
    SCOPED_TRACE(query);
    const auto source = striper.open(query);
    source->start();
    const auto is_lit = [](const Frame& frame) { return frame.illumination.is_lit(); };
    EXPECT_TRUE(soon(*source, is_lit));
    source->controls().set("laser", {0.0});
    EXPECT_FALSE(striper.camera->statistics().is_laser_armed);
    int dark_in_a_row = 0;
    EXPECT_TRUE(soon(*source, [&](const Frame& frame) {
      dark_in_a_row = frame.illumination.is_dark() ? dark_in_a_row + 1 : 0;
      return dark_in_a_row == 10;
    }));
    source->stop();
    source->start();
    for (int i = 0; i < 5; ++i) EXPECT_TRUE(next(*source).illumination.is_dark());
    source->controls().set("laser", {1.0});
    EXPECT_TRUE(soon(*source, is_lit));
  }
}

TEST(GigeControls, EncoderCountsComeWithTheirFrame) {
  VirtualCameraOptions options;
  options.encoder_counts_per_s = 12345.0;
  const VirtualStriper striper(pattern(), options);
  const auto source = striper.open("fps=100&encoder=yes&strobe=Line2&laser=0");
  source->start();
  const Frame first = next(*source);
  ASSERT_TRUE(first.encoder_counts.has_value());
  for (int i = 0; i < 20; ++i) {
    const Frame frame = next(*source);
    ASSERT_TRUE(frame.encoder_counts.has_value());
    EXPECT_TRUE(frame.illumination.is_lit());  // Beside the other chunk.
    // The camera's exposures are a period apart by its own clock.
    const auto periods = static_cast<double>(frame.sequence - first.sequence);
    EXPECT_NEAR(static_cast<double>(*frame.encoder_counts - *first.encoder_counts),
                123.45 * periods, 1.001);
  }
}

TEST(GigeControls, FramesHaveNoCountsUnlessTheyAreAskedFor) {
  const VirtualStriper striper(pattern());
  const auto source = striper.open("fps=100");
  source->start();
  EXPECT_FALSE(next(*source).encoder_counts.has_value());
}

TEST(GigeControls, CameraWithoutAnEncoderIsRefusedByName) {
  detail::CameraFaults faults;
  faults.lacking = {"ChunkSelector.EncoderValue"};
  const VirtualStriper striper(pattern(), {}, faults);
  const Error error = testing::error_of([&] { striper.open("encoder=yes"); });
  EXPECT_EQ(error.kind(), ErrorKind::kUnsupported);
  EXPECT_THAT(error.what(), HasSubstr("encoder=yes: its frames come without EncoderValue"));
  EXPECT_THAT(testing::error_of([&] { striper.open("encoder=wheel"); }).what(),
              HasSubstr("encoder=wheel - expected yes, no, or which one"));
}

}  // namespace
}  // namespace striper
