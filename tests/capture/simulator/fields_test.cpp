// SPDX-License-Identifier: Apache-2.0
// Proves that interlaced fields are the rows of the progressive image of their own time,
// interlaced or one by one, and that the lasers follow their pattern. Does not prove how a source
// hands them out.
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/core/error.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/error_of.hpp"

namespace striper {
namespace {

Scene quiet_wall() {
  Scene scene = Scene::flat_wall(2.0);
  scene.imager.noise = {.shot = false, .read_noise_e = 0.0};
  scene.imager.blur_sigma_px = 0.5;
  scene.daylight.sky_w_m2_nm = 0.3;
  return scene;
}

cv::Mat rows_of(const cv::Mat& image, int first) {
  cv::Mat rows(image.rows / 2, image.cols, image.type());
  for (int i = 0; i < rows.rows; ++i) image.row(first + 2 * i).copyTo(rows.row(i));
  return rows;
}

double difference(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF); }

TEST(SimulatedFields, InterlacedFieldsOfAStaticSceneAreTheProgressiveImage) {
  Scene scene = quiet_wall();
  const Frame progressive = Simulator(scene).render(3);
  for (const ScanMode scan : {ScanMode::kTopFirst, ScanMode::kBottomFirst}) {
    scene.timing.scan = scan;
    const Frame interlaced = Simulator(scene).render(3);
    EXPECT_EQ(difference(interlaced.image, progressive.image), 0.0);
    EXPECT_EQ(interlaced.field, scan == ScanMode::kTopFirst ? Field::kInterlacedTopFirst
                                                            : Field::kInterlacedBottomFirst);
    EXPECT_EQ(interlaced.exposures_per_picture, 2);
    EXPECT_EQ(interlaced.exposure_number(), 6U);
    EXPECT_EQ(interlaced.time.monotonic_ns, 100'000'000);
    EXPECT_EQ(interlaced.field_period_ns, 16'666'667);
    EXPECT_EQ(interlaced.illumination, Illumination::laser(0));
  }
}

TEST(SimulatedFields, FieldsOneByOneAreTheRowsOfTheInterlacedImage) {
  Scene scene = quiet_wall();
  scene.objects[0].motion.velocity_m_s = {-5.0, 0.0, 0.0};
  scene.timing.pattern = IlluminationPattern::parse("0,dark");
  scene.timing.scan = ScanMode::kBottomFirst;
  const Frame interlaced = Simulator(scene).render(2);
  EXPECT_TRUE(interlaced.illumination.is_unknown());  // Its two fields differ.
  scene.timing.scan = ScanMode::kAlternateBottomFirst;
  Simulator by_field(scene);
  ASSERT_EQ(by_field.parts_per_frame(), 2);
  const Frame first = by_field.render(2, 0);
  const Frame second = by_field.render(2, 1);
  EXPECT_EQ(difference(first.image, rows_of(interlaced.image, 1)), 0.0);
  EXPECT_EQ(difference(second.image, rows_of(interlaced.image, 0)), 0.0);
  EXPECT_EQ(first.field, Field::kBottom);
  EXPECT_EQ(second.field, Field::kTop);
  EXPECT_EQ(first.grid, PixelGrid::bottom_field());
  EXPECT_EQ(second.grid, PixelGrid::top_field());
  EXPECT_EQ(first.sensor_size, cv::Size(640, 480));
  EXPECT_EQ(first.exposure_number(), 4U);
  EXPECT_EQ(second.exposure_number(), 5U);
  EXPECT_EQ(first.illumination, Illumination::laser(0));
  EXPECT_EQ(second.illumination, Illumination::dark());
  EXPECT_EQ(second.time.monotonic_ns - first.time.monotonic_ns, 16'666'667);
}

TEST(SimulatedFields, EachFieldIsExposedAtItsOwnTime) {
  Scene scene = quiet_wall();
  scene.objects[0].motion.velocity_m_s = {-6.0, 0.0, 0.0};
  Scene twice_as_fast = scene;
  twice_as_fast.timing.picture_rate_hz = 60.0;
  Simulator progressive(twice_as_fast);
  scene.timing.scan = ScanMode::kTopFirst;
  Simulator simulator(scene);
  const cv::Mat interlaced = simulator.render(3).image;
  EXPECT_EQ(difference(rows_of(interlaced, 0), rows_of(progressive.render(6).image, 0)), 0.0);
  EXPECT_EQ(difference(rows_of(interlaced, 1), rows_of(progressive.render(7).image, 1)), 0.0);
  EXPECT_GT(difference(rows_of(interlaced, 1), rows_of(progressive.render(6).image, 1)), 10.0);
}

TEST(SimulatedFields, LaserInOneFieldLeavesTheOtherDark) {
  Scene scene = quiet_wall();
  scene.timing.scan = ScanMode::kTopFirst;
  scene.timing.pattern = IlluminationPattern::parse("0,dark");
  Simulator simulator(scene);
  const cv::Mat image = simulator.render(0).image;
  scene.lasers[0].pulse_energy_j = 0.0;
  const cv::Mat without = Simulator(scene).render(0).image;
  EXPECT_GT(difference(rows_of(image, 0), rows_of(without, 0)), 50.0);
  EXPECT_EQ(difference(rows_of(image, 1), rows_of(without, 1)), 0.0);

  const std::vector<Truth> truths = simulator.truth(0);
  ASSERT_EQ(truths.size(), 1U);
  EXPECT_EQ(truths[0].field, Field::kTop);
  EXPECT_EQ(truths[0].lines.size(), 640U);
}

TEST(SimulatedFields, TruthOfRowsIsPerFieldLine) {
  Scene scene = quiet_wall();
  scene.axis = StripeAxis::kRows;
  scene.lasers[0].T_device_laser = Eigen::Translation3d(0.0, 0.4, 0.0) *
                                   Eigen::Isometry3d(rotation_from_rpy(M_PI / 2, 0.0, 0.0));
  scene.timing.scan = ScanMode::kBottomFirst;
  Simulator simulator(scene);
  const std::vector<Truth> truths = simulator.truth(1);
  ASSERT_EQ(truths.size(), 2U);
  EXPECT_EQ(truths[0].field, Field::kBottom);
  ASSERT_EQ(truths[0].lines.size(), 240U);
  EXPECT_EQ(truths[0].lines[10].brightest.v_px, 21.0);
  EXPECT_EQ(truths[1].lines[10].brightest.v_px, 20.0);
  EXPECT_NEAR(truths[1].time_s - truths[0].time_s, 1.0 / 60.0, 1e-12);
  EXPECT_NEAR(truths[0].lines[10].brightest.x_m, 2.0, 1e-9);
}

TEST(SimulatedPattern, LasersTakeTurns) {
  Scene scene = quiet_wall();
  scene.lasers.push_back(scene.lasers[0]);
  scene.lasers[1].T_device_laser.translation().z() = -0.7;
  scene.timing.pattern = IlluminationPattern::parse("0,1,dark");
  Simulator simulator(scene);
  const double f = scene.camera.fx();
  for (std::uint64_t sequence = 0; sequence < 6; ++sequence) {
    const Frame frame = simulator.render(sequence);
    const std::vector<Truth> truths = simulator.truth(sequence);
    EXPECT_EQ(frame.illumination, scene.timing.pattern.at(sequence));
    ASSERT_EQ(truths.size(), sequence % 3 == 2 ? 0U : 1U);
    if (truths.empty()) continue;
    const int laser = static_cast<int>(sequence % 3);
    EXPECT_EQ(truths[0].laser, laser);
    EXPECT_NEAR(truths[0].lines[5].brightest.v_px, 239.5 + f * (laser == 0 ? 0.5 : 0.7) / 2.0,
                1e-8);
    EXPECT_NEAR(truths[0].lines[5].brightest.x_m, 2.0, 1e-9);
  }
  EXPECT_EQ(simulator.model().lasers.size(), 2U);
  EXPECT_NEAR(simulator.model().lasers[1].plane.distance_m(), 0.7, 1e-12);
}

TEST(SimulatedPattern, PartThatAFrameDoesNotHaveIsRefused) {
  Simulator simulator(quiet_wall());
  const Error error = testing::error_of([&] { simulator.render(0, 1); });
  EXPECT_STREQ(error.what(), "part 1 of a frame - expected 0 to 0");
}

}  // namespace
}  // namespace striper
