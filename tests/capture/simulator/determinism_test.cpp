// SPDX-License-Identifier: Apache-2.0
// Proves that an image depends on nothing but scene, seed and number: golden hashes, any order, in
// part and binned. The hashes are of noisy images; if they change on purpose, run
// `simulator_tests --gtest_filter=Determinism.*` and take the new ones from its output.
#include <cstdint>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/shared_data.hpp"

namespace striper {
namespace {

/// FNV-1a (Fowler, Noll & Vo 1991) over the rows of an image, low byte first.
std::uint64_t hash_of(const cv::Mat& image) {
  std::uint64_t hash = 0xCBF29CE484222325ULL;
  const auto add = [&hash](int byte) {
    hash = (hash ^ static_cast<std::uint64_t>(byte)) * 0x100000001B3ULL;
  };
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      if (image.depth() == CV_8U) {
        add(image.at<std::uint8_t>(row, column));
      } else {
        add(image.at<std::uint16_t>(row, column) & 0xFF);
        add(image.at<std::uint16_t>(row, column) >> 8);
      }
    }
  }
  return hash;
}

Scene noisy_room() {
  Scene scene = load_scene(testing::source_path("data/scenes/room.yaml"));
  scene.imager.noise = {.shot = true, .read_noise_e = 10.0, .prnu = 0.01, .speckle = 0.05};
  return scene;
}

TEST(Determinism, GoldenImages) {
  Simulator room(load_scene(testing::source_path("data/scenes/room.yaml")));
  EXPECT_EQ(hash_of(room.render(0).image), 17248708907072496603ULL);
  EXPECT_EQ(hash_of(room.render(7).image), 3520586210886423581ULL);
  Scene scene = noisy_room();
  scene.imager.bit_depth = 12;
  scene.imager.dn_per_electron = 0.5;
  EXPECT_EQ(hash_of(Simulator(scene).render(1000000).image), 829214460643710309ULL);
}

TEST(Determinism, GoldenImagesOfMovingScenes) {
  Scene sun = load_scene(testing::source_path("data/scenes/ntsc_sun.yaml"));
  sun.device_motion.velocity_m_s = {5.0, 0.5, 0.0};
  EXPECT_EQ(hash_of(Simulator(sun).render(3).image), 18278953447976537933ULL);
  Scene room = load_scene(testing::source_path("data/scenes/room.yaml"));
  room.daylight.sun_w_m2_nm = 0.3;
  room.device_motion.velocity_m_s = {0.3, 0.2, 0.0};
  room.device_motion.angular_velocity_rad_s = {0.02, 0.04, 0.06};
  EXPECT_EQ(hash_of(Simulator(room).render(9).image), 37739690758276281ULL);
}

TEST(Determinism, OrderOfImagesDoesNotMatter) {
  Scene scene = noisy_room();
  scene.objects[4].motion.velocity_m_s = {0.0, 0.5, 0.0};
  Simulator forward(scene);
  Simulator backward(scene);
  const std::uint64_t first = hash_of(forward.render(3).image);
  const std::uint64_t second = hash_of(forward.render(4).image);
  EXPECT_EQ(hash_of(backward.render(4).image), second);
  EXPECT_EQ(hash_of(backward.render(3).image), first);
  EXPECT_NE(first, second);
}

TEST(Determinism, SeedsDiffer) {
  Scene scene = Scene::flat_wall(2.0);
  const std::uint64_t first = hash_of(Simulator(scene).render(0).image);
  scene.seed = 2;
  EXPECT_NE(hash_of(Simulator(scene).render(0).image), first);
}

TEST(Determinism, RegionOfInterestIsCutFromTheWholeImageNoiseAndAll) {
  Scene scene = noisy_room();
  Simulator whole(scene);
  scene.imager.region = cv::Rect(101, 202, 300, 150);
  Simulator part(scene);
  const Frame frame = part.render(5);
  EXPECT_EQ(frame.grid, PixelGrid::region(101, 202));
  EXPECT_EQ(frame.sensor_size, cv::Size(640, 480));
  // To the border, too, over which the lens blur brings light.
  const cv::Mat cut = whole.render(5).image(scene.imager.region);
  EXPECT_EQ(cv::norm(frame.image, cut, cv::NORM_INF), 0.0);

  const Truth of_part = part.truth(5).at(0);
  const Truth of_whole = whole.truth(5).at(0);
  ASSERT_EQ(of_part.lines.size(), 300U);
  for (std::size_t i = 0; i < of_part.lines.size(); ++i) {
    const TrueLine& line = of_part.lines[i];
    EXPECT_EQ(line.brightest.u_px, 101.0 + static_cast<double>(i));
    if (line.status != TruthStatus::kVisible) continue;
    EXPECT_NEAR(line.brightest.v_px, of_whole.lines[i + 101].brightest.v_px, 1e-9);
  }
}

TEST(Determinism, BinsAreSumsOfPixels) {
  Scene scene = noisy_room();
  scene.imager.black_level_dn = 0.0;
  const cv::Mat fine = Simulator(scene).expected_dn(0);
  scene.imager.binning = {2, 4};
  Simulator binned(scene);
  const cv::Mat coarse = binned.expected_dn(0);
  ASSERT_EQ(coarse.size(), cv::Size(320, 120));
  for (int row = 0; row < coarse.rows; ++row) {
    for (int column = 0; column < coarse.cols; ++column) {
      const double sum = cv::sum(fine(cv::Rect(2 * column, 4 * row, 2, 4)))[0];
      ASSERT_NEAR(coarse.at<float>(row, column), sum, 1e-3);
    }
  }
  const Frame frame = binned.render(0);
  EXPECT_EQ(frame.grid, PixelGrid::binned(2, 4));
  const Truth truth = binned.truth(0).at(0);
  ASSERT_EQ(truth.lines.size(), 320U);
  EXPECT_EQ(truth.lines[10].brightest.u_px, 20.5);
}

}  // namespace
}  // namespace striper
