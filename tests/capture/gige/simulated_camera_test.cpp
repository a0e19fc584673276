// SPDX-License-Identifier: Apache-2.0
// Proves that the simulator's images come out of a GigE Vision camera bit for bit as they come
// out of `sim:`, over real packets on loopback: whole and in regions, 8, 12 and 16 bits, lit and
// dark by the client's own command. What scans become of them is compared in tests/end_to_end.
#include <chrono>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulated_source.hpp>

#include "capture/gige/virtual_striper.hpp"
#include "support/error_of.hpp"

namespace striper::testing {
namespace {

using namespace std::chrono_literals;

struct Format {
  const char* name;
  int bit_depth;
  cv::Rect region;
};

void PrintTo(const Format& format, std::ostream* out) {
  *out << format.name << " of " << format.region;
}

class SimulatedCamera : public ::testing::TestWithParam<Format> {};

Scene scene_of(int bit_depth) {
  Scene scene = parse_scene(R"(striper_scene: 1
camera: {width: 160, height: 120, fov_deg: 55, lens: plumb_bob, distortion: [-0.2, 0.05, 0, 0, 0]}
imager: {blur_px: 0.5, black_level_dn: 8, dn_per_electron: 0.02}
noise: {shot: yes, read_e: 20, seed: 2002}
timing: {picture_rate_hz: 50, cadence: "0,dark"}
lasers:
  - {position_m: [0, 0, -0.5], fan_deg: 60, thickness_deg: 0.3, wavelength_nm: 900, pulse_uj: 10}
objects:
  - {name: wall, shape: plane, position_m: [2, 0, 0], reflectance: 0.5}
)",
                            "wall");
  scene.imager.bit_depth = bit_depth;
  scene.imager.dn_per_electron *= 1 << (bit_depth - 8);
  return scene;
}

TEST_P(SimulatedCamera, GivesTheImagesOfTheSimulatorBitForBit) {
  const auto [format, bits, region] = GetParam();
  Scene scene = scene_of(bits);
  const VirtualStriper striper(make_virtual_scene(scene));
  scene.imager.region = region;
  SimulatedSource simulator{Simulator(scene)};
  const auto camera =
      striper.open(fmt::format("pixel_format={}&roi={},{},{},{}&strobe=Line2&laser=0,dark", format,
                               region.x, region.y, region.width, region.height));
  camera->start();
  simulator.start();
  for (int n = 0; n < 6; ++n) {
    Frame expected;
    Frame frame;
    ASSERT_EQ(simulator.next(expected, 0ms), NextStatus::kFrame);
    ASSERT_EQ(camera->next(frame, 5000ms), NextStatus::kFrame);
    ASSERT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
    EXPECT_EQ(frame.sequence, expected.sequence);
    EXPECT_EQ(frame.illumination, expected.illumination);
    EXPECT_EQ(frame.grid, expected.grid);
    EXPECT_EQ(frame.sensor_size, expected.sensor_size);
    EXPECT_EQ(frame.bit_depth, expected.bit_depth);
    ASSERT_EQ(frame.image.size(), expected.image.size());
    ASSERT_EQ(frame.image.type(), expected.image.type());
    EXPECT_EQ(cv::norm(frame.image, expected.image, cv::NORM_INF), 0.0) << "frame " << n;
  }
}

// The camera's sequencer holds each entry's exposure; the laser shines on while the shutter is
// open.
TEST(BracketOfACamera, GivesTheImagesOfTheSimulatorBitForBit) {
  const std::string pattern = "0@100,dark@100,0@8100,dark@8100";
  Scene scene = scene_of(8);
  scene.lasers.front().is_continuous = true;
  const VirtualStriper striper(make_virtual_scene(scene));
  scene.timing.pattern = IlluminationPattern::parse(pattern);
  SimulatedSource simulator{Simulator(scene)};
  const auto camera = striper.open("strobe=Line2&laser=" + pattern);
  camera->start();
  simulator.start();
  std::int64_t last_ns = 0;
  for (int n = 0; n < 12; ++n) {
    Frame expected;
    Frame frame;
    ASSERT_EQ(simulator.next(expected, 0ms), NextStatus::kFrame);
    ASSERT_EQ(camera->next(frame, 5000ms), NextStatus::kFrame);
    ASSERT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
    ASSERT_EQ(frame.sequence, expected.sequence);
    EXPECT_EQ(frame.illumination, expected.illumination);
    EXPECT_EQ(frame.exposure_ns, n % 4 < 2 ? 100'000 : 8'100'000);
    EXPECT_EQ(frame.exposure_ns, expected.exposure_ns);
    EXPECT_EQ(cv::norm(frame.image, expected.image, cv::NORM_INF), 0.0) << "frame " << n;
    // From middle to middle, 20 ms after each other, where one is 8 ms longer than the other.
    const double apart_ms = 1e-6 * static_cast<double>(frame.time.monotonic_ns - last_ns);
    const double expected_ms = n % 4 == 2 ? 24.0 : n % 4 == 0 ? 16.0 : 20.0;
    if (n > 4) {
      EXPECT_NEAR(apart_ms, expected_ms, 1.5) << "frame " << n;
    }
    last_ns = frame.time.monotonic_ns;
  }
}

TEST(BracketOfACamera, ItsExposuresAreNotForAControl) {
  const VirtualStriper striper(make_virtual_scene(scene_of(8)));
  const auto camera = striper.open("strobe=Line2&laser=0@100,dark@100");
  const Error error = error_of([&] { camera->controls().set("exposure_us", {50.0}); });
  EXPECT_THAT(error.what(), ::testing::HasSubstr("laser=0@100,dark@100"));
}

TEST(BracketOfACamera, NeedsTheSequencerAndALine) {
  const VirtualStriper striper(make_virtual_scene(scene_of(8)));
  const Error lineless = error_of([&] { striper.open("laser=0@100,dark@100"); });
  EXPECT_THAT(lineless.what(), ::testing::HasSubstr("add strobe=LINE"));
  const Error by_host =
      error_of([&] { striper.open("strobe=Line2&switching=host&laser=0@100,dark@100"); });
  EXPECT_THAT(by_host.what(), ::testing::HasSubstr("switching=host"));
}

const cv::Rect kWhole(0, 0, 160, 120);
const cv::Rect kPart(24, 40, 96, 64);

INSTANTIATE_TEST_SUITE_P(
    Formats, SimulatedCamera,
    ::testing::Values(Format{"Mono8", 8, kWhole}, Format{"Mono8", 8, kPart},
                      Format{"Mono12", 12, kWhole}, Format{"Mono12", 12, kPart},
                      Format{"Mono12Packed", 12, kPart}, Format{"Mono16", 16, kWhole},
                      Format{"Mono16", 16, kPart}),
    [](const auto& tried) {
      return std::string(tried.param.name) + (tried.param.region == kWhole ? "" : "_region");
    });

}  // namespace
}  // namespace striper::testing
