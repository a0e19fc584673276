// SPDX-License-Identifier: Apache-2.0
// Proves that what a virtual camera looks at is the simulator's image, bit for bit, whichever
// laser a client lights, and that a looped scene repeats the first images. That the images then
// cross the wire unchanged is proved in simulated_camera_test.cpp.
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>
#include <striper/virtual_camera/virtual_scene.hpp>

namespace striper {
namespace {

Scene two_lasers(const std::string& pattern) {
  return parse_scene(R"(striper_scene: 1
camera: {width: 96, height: 64, fov_deg: 55, lens: plumb_bob}
imager: {blur_px: 0.5, black_level_dn: 8}
noise: {shot: yes, read_e: 20, seed: 7}
timing: {picture_rate_hz: 40, cadence: ")" +
                         pattern + R"("}
lasers:
  - {position_m: [0, 0, -0.5], fan_deg: 60, thickness_deg: 0.3, wavelength_nm: 900, pulse_uj: 10}
  - {position_m: [0, 0, -0.3], fan_deg: 60, thickness_deg: 0.3, wavelength_nm: 900, pulse_uj: 10}
objects:
  - {name: wall, shape: plane, position_m: [2, 0, 0], reflectance: 0.5}
)",
                     "two_lasers");
}

cv::Mat rendered(const std::string& pattern, std::uint64_t n) {
  return Simulator(two_lasers(pattern)).render(n).image;
}

double difference(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF); }

TEST(VirtualScene, TellsWhatTheSceneIs) {
  const auto scene = make_virtual_scene(two_lasers("0,dark,1"));
  EXPECT_EQ(scene->sensor_size(), cv::Size(96, 64));
  EXPECT_EQ(scene->bit_depth(), 8);
  EXPECT_EQ(scene->rate_hz(), 40.0);
  EXPECT_EQ(scene->pattern(), IlluminationPattern::parse("0,dark,1"));
}

TEST(VirtualScene, AnImageIsTheSimulatorsWithThatLight) {
  const auto scene = make_virtual_scene(two_lasers("0"));
  for (std::uint64_t n = 0; n < 4; ++n) {
    const std::string dark = n % 2 == 0 ? "dark,0" : "0,dark";
    const cv::Mat by_laser_0 = scene->image(n, Illumination::laser(0)).clone();
    EXPECT_EQ(difference(by_laser_0, rendered("0", n)), 0.0) << n;
    EXPECT_EQ(difference(scene->image(n, Illumination::laser(1)), rendered("1", n)), 0.0) << n;
    EXPECT_EQ(difference(scene->image(n, Illumination::dark()), rendered(dark, n)), 0.0) << n;
    EXPECT_GT(difference(by_laser_0, rendered("1", n)), 10.0) << "the lasers light the same";
    EXPECT_GT(difference(by_laser_0, rendered(dark, n)), 10.0) << "the laser lights nothing";
  }
}

TEST(VirtualScene, ALineWithoutALaserLightsNothing) {
  const auto scene = make_virtual_scene(two_lasers("0"));
  EXPECT_EQ(difference(scene->image(2, Illumination::laser(5)), rendered("dark,0", 2)), 0.0);
}

TEST(VirtualScene, TheSensorIsReadWholeWhateverTheSceneReads) {
  Scene scene = two_lasers("0");
  scene.imager.region = cv::Rect(8, 8, 32, 16);
  const auto whole = make_virtual_scene(scene);
  EXPECT_EQ(whole->sensor_size(), cv::Size(96, 64));
  EXPECT_EQ(difference(whole->image(0, Illumination::laser(0)), rendered("0", 0)), 0.0);
}

TEST(VirtualScene, ALoopedOneRepeatsItsFirstImages) {
  const auto looped = make_looped_scene(make_virtual_scene(two_lasers("0,dark")), 3);
  EXPECT_EQ(looped->sensor_size(), cv::Size(96, 64));
  EXPECT_EQ(looped->pattern(), IlluminationPattern::parse("0,dark"));
  for (const std::uint64_t n : {0U, 1U, 2U, 3U, 7U, 3000001U}) {
    EXPECT_EQ(difference(looped->image(n, Illumination::laser(0)), rendered("0", n % 3)), 0.0) << n;
  }
}

}  // namespace
}  // namespace striper
