// SPDX-License-Identifier: Apache-2.0
// Proves that the simulator shows what its controls were set to, from the next frame on and in the
// truth as well, and that an encoder counts the device's path. That controls are controls is proved
// by the conformance suite.
#include <chrono>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/core/error.hpp>
#include <striper/simulator/simulated_source.hpp>

#include "support/error_of.hpp"

namespace striper {
namespace {

using ::testing::ElementsAre;

// A wall 2 m in front of the camera, by name.
Scene named_wall() {
  Scene scene = Scene::flat_wall(2.0);
  scene.objects.front().name = "wall";
  scene.imager.noise = {.shot = false, .read_noise_e = 0.0};
  return scene;
}

Frame next(FrameSource& source) {
  Frame frame;
  EXPECT_EQ(source.next(frame, std::chrono::milliseconds(0)), NextStatus::kFrame);
  frame.image = frame.image.clone();
  return frame;
}

double middle_range_m(SimulatedSource& source, std::uint64_t sequence) {
  const Truth truth = source.simulator().truth(sequence).at(0);
  return truth.lines.at(truth.lines.size() / 2).brightest.range_m;
}

double largest(const cv::Mat& image) {
  double most = 0.0;
  cv::minMaxIdx(image, nullptr, &most);
  return most;
}

TEST(SimulatedControls, PoseMovesAnObjectBetweenFrames) {
  SimulatedSource source{Simulator(named_wall())};
  source.start();
  const Frame before = next(source);
  const double near_m = middle_range_m(source, before.sequence);
  const Control pose = source.controls().get("sim.pose.wall");
  EXPECT_EQ(pose.type, ControlType::kPose);

  ControlValue moved = pose.state.value;
  moved[0] += 1.0;
  EXPECT_EQ(source.controls().set("sim.pose.wall", moved).state.value, moved);
  const Frame after = next(source);
  // From 2 m to 3 m along the axis, which the middle scan line is almost on.
  EXPECT_NEAR(middle_range_m(source, after.sequence), 1.5 * near_m, 1e-9);
  EXPECT_GT(cv::norm(before.image, after.image, cv::NORM_INF), 10.0);

  source.controls().set("sim.pose.wall", pose.state.value);
  EXPECT_EQ(cv::norm(before.image, next(source).image, cv::NORM_INF), 0.0);
}

TEST(SimulatedControls, TurnedPoseIsReadBackAsItWasSet) {
  SimulatedSource source{Simulator(named_wall())};
  const ControlValue turned{3.0, -0.5, 0.25, 10.0, -20.0, 30.0};
  EXPECT_EQ(source.controls().set("sim.pose.wall", turned).state.value, turned);
  source.start();
  next(source);
  const Eigen::Isometry3d pose = source.simulator().scene().objects.front().T_world_object;
  EXPECT_TRUE(pose.translation().isApprox(Eigen::Vector3d(3.0, -0.5, 0.25)));
  // A source of the turned scene reads the same angles from its matrix.
  SimulatedSource other{Simulator(source.simulator().scene())};
  const ControlValue read = other.controls().get("sim.pose.wall").state.value;
  for (std::size_t i = 0; i < turned.size(); ++i) EXPECT_NEAR(read[i], turned[i], 1e-9);
}

TEST(SimulatedControls, ObjectsThatShareANameHaveNone) {
  Scene scene = named_wall();
  scene.objects.push_back(scene.objects.front());
  scene.objects.back().T_world_object.translation().x() += 1.0;
  SimulatedSource source{Simulator(scene)};
  EXPECT_EQ(testing::error_of([&] { source.controls().get("sim.pose.wall"); }).kind(),
            ErrorKind::kUsage);
}

TEST(SimulatedControls, LaserOffIsDark) {
  SimulatedSource source{Simulator(named_wall())};
  source.start();
  const Frame lit = next(source);
  source.controls().set("laser", {0.0});
  const Frame dark = next(source);
  EXPECT_TRUE(dark.illumination.is_dark());
  EXPECT_TRUE(source.simulator().truth(dark.sequence).empty());
  EXPECT_GT(largest(lit.image), largest(dark.image) + 20.0);
  source.controls().set("laser", {1.0});
  EXPECT_EQ(next(source).illumination, Illumination::laser(0));
}

TEST(SimulatedControls, ExposureAndGainScaleTheDaylight) {
  Scene scene = named_wall();
  scene.daylight.ambient_w_m2_nm = 2.0;
  scene.imager.bit_depth = 16;
  SimulatedSource source{Simulator(scene)};
  source.start();
  const auto level_dn = [&](const Frame& frame) {
    // Away from the stripe.
    return frame.image.at<std::uint16_t>(2, frame.image.cols / 2) - scene.imager.black_level_dn;
  };
  const Frame before = next(source);
  ASSERT_GT(level_dn(before), 20.0);
  const double exposure_us = source.controls().get("exposure_us").state.value[0];
  EXPECT_NEAR(exposure_us, 1e6 * scene.imager.shutter_s, 1e-9);
  source.controls().set("exposure_us", {2.0 * exposure_us});
  const Frame longer = next(source);
  EXPECT_EQ(longer.exposure_ns, 2 * before.exposure_ns);
  EXPECT_NEAR(level_dn(longer), 2.0 * level_dn(before), 2.0);
  EXPECT_THAT(source.controls().set("gain_db", {20.0}).state.value, ElementsAre(20.0));
  EXPECT_NEAR(level_dn(next(source)), 20.0 * level_dn(before), 20.0);
}

TEST(SimulatedControls, ExposureScalesALaserThatShinesOnAndNoPulse) {
  for (const bool is_continuous : {true, false}) {
    Scene scene = named_wall();
    scene.imager.bit_depth = 16;
    scene.lasers.at(0).is_continuous = is_continuous;
    SimulatedSource source{Simulator(scene)};
    source.start();
    const auto stripe_dn = [&](const Frame& frame) {
      return cv::sum(frame.image)[0] -
             scene.imager.black_level_dn * static_cast<double>(frame.image.total());
    };
    const double before_dn = stripe_dn(next(source));
    const double exposure_us = source.controls().get("exposure_us").state.value[0];
    source.controls().set("exposure_us", {3.0 * exposure_us});
    EXPECT_NEAR(stripe_dn(next(source)) / before_dn, is_continuous ? 3.0 : 1.0, 0.02);
  }
}

TEST(SimulatedControls, EncoderCountsThePathOfTheDevice) {
  Scene scene = named_wall();
  scene.device_motion.velocity_m_s = Eigen::Vector3d(0.0, 3.0, 0.0);
  scene.timing.picture_rate_hz = 10.0;
  SimulatedSourceOptions options;
  options.encoder_counts_per_m = 101.0;
  options.encoder_bits = 8;
  SimulatedSource source{Simulator(scene), options};
  source.start();
  for (const std::int64_t counts : {0, 30, 60, 90, 121, 151, 181, 212, 242, 272 - 256}) {
    EXPECT_EQ(next(source).encoder_counts, counts);
  }
  SimulatedSource without{Simulator(scene)};
  without.start();
  EXPECT_FALSE(next(without).encoder_counts.has_value());
}

}  // namespace
}  // namespace striper
