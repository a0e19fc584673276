// SPDX-License-Identifier: Apache-2.0
// Proves the light budget against the numbers printed in the striper paper (Mertz et al. 2002) and
// against laws of optics, and that the renderer obeys it. Does not prove that a real sensor has
// these transmissions and efficiencies.
#include <cmath>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/simulator/radiometry.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/error_of.hpp"

namespace striper {
namespace {

constexpr double kDegree = M_PI / 180.0;

/// The paper's striper in the paper's sun: 60 x 0.4 degree fan, 10.4 uJ, 1/400000 s, 25 nm.
Scene paper_in_sun(double distance_m) {
  Scene scene = Scene::flat_wall(distance_m);
  scene.daylight.sun_w_m2_nm = 856.0 / 1000.0;
  scene.daylight.sun_direction = -Eigen::Vector3d::UnitX();  // Square on the wall.
  return scene;
}

TEST(Radiometry, DefaultStriperIsThePapers) {
  const Scene scene;
  EXPECT_DOUBLE_EQ(scene.lasers.at(0).fan_rad, 60.0 * kDegree);
  EXPECT_DOUBLE_EQ(scene.lasers.at(0).pulse_energy_j, 10.4e-6);
  EXPECT_DOUBLE_EQ(scene.lasers.at(0).T_device_laser.translation().z(), -0.5);
  EXPECT_DOUBLE_EQ(scene.imager.shutter_s, 1.0 / 400000.0);
  EXPECT_DOUBLE_EQ(scene.imager.filter.width_nm, 25.0);
}

TEST(Radiometry, LaserIsEightyThousandTimesWeakerThanSunlight) {
  // The paper: average laser light at 2 m is 8e4 times less intense than sunlight, 30 pulses/s.
  const Scene scene = paper_in_sun(2.0);
  const double average_w_m2 = 30.0 * peak_fluence_j_m2(scene.lasers[0], 2.0);
  EXPECT_NEAR(856.0 / average_w_m2, 8e4, 0.01 * 8e4);
}

TEST(Radiometry, FilterReducesTheSunByForty) {
  const Scene scene = paper_in_sun(2.0);
  const double all_w_m2 = 856.0;
  const double in_band_w_m2 = sun_fluence_j_m2(scene) / scene.imager.shutter_s;
  EXPECT_NEAR(all_w_m2 / in_band_w_m2, 40.0, 1e-9);
}

TEST(Radiometry, StripeToSunIsThePapersSixAndAHalfAtTwoMetres) {
  const Scene scene = paper_in_sun(2.0);
  // 13000 * 40 / 8e4 with the paper's rounded numbers.
  EXPECT_NEAR(stripe_to_sun_ratio(scene, 0, 2.0), 6.5, 0.03 * 6.5);
  // Tenth of the filter's width, two and a half times the ratio: the paper's 10 nm filter.
  Scene narrow = scene;
  narrow.imager.filter.width_nm = 10.0;
  EXPECT_NEAR(stripe_to_sun_ratio(narrow, 0, 2.0) / stripe_to_sun_ratio(scene, 0, 2.0), 2.5, 1e-9);
}

TEST(Radiometry, RenderedImageHasTheStripeToSunRatioOfTheFormula) {
  for (const double distance_m : {1.5, 2.0, 3.0}) {
    Scene scene = paper_in_sun(distance_m);
    Simulator simulator(scene);
    const cv::Mat image = simulator.expected_dn(0);
    const TrueReturn stripe = simulator.truth(0).at(0).lines.at(320).brightest;
    const double sun_dn = image.at<float>(20, 320) - scene.imager.black_level_dn;
    EXPECT_NEAR(stripe.amplitude_dn / sun_dn, stripe_to_sun_ratio(scene, 0, distance_m),
                1e-3 * stripe.amplitude_dn / sun_dn);
  }
}

TEST(Radiometry, AsphaltStripeIsDimmerThanSunlitSnow) {
  // The paper: on asphalt (5 %) beside snow (80 %) "the laser line is not the brightest return".
  const Scene scene = paper_in_sun(2.0);
  const double ratio = stripe_to_sun_ratio(scene, 0, 2.0);
  EXPECT_NEAR(0.05 * ratio / 0.8, 0.41, 0.01);
  EXPECT_NEAR(0.05 * ratio / 0.5, 0.65, 0.02);
}

TEST(Radiometry, FluenceFallsWithTheSquareOfRangeWhereTheSheetDiverges) {
  SimulatedLaser laser;
  EXPECT_NEAR(peak_fluence_j_m2(laser, 1.0) / peak_fluence_j_m2(laser, 3.0), 9.0, 1e-12);
  laser.waist_sigma_m = 1e-3;
  laser.divergence_sigma_rad = 0.0;
  EXPECT_NEAR(peak_fluence_j_m2(laser, 1.0) / peak_fluence_j_m2(laser, 3.0), 3.0, 1e-12);
}

TEST(Radiometry, SheetIsThinnestAtItsFocus) {
  SimulatedLaser laser;
  laser.waist_sigma_m = 0.5e-3;
  laser.divergence_sigma_rad = 1e-3;
  laser.focus_m = 2.0;
  EXPECT_DOUBLE_EQ(thickness_sigma_m(laser, 2.0), 0.5e-3);
  EXPECT_DOUBLE_EQ(thickness_sigma_m(laser, 1.0), thickness_sigma_m(laser, 3.0));
  EXPECT_NEAR(thickness_sigma_m(laser, 3.0), std::hypot(0.5e-3, 1e-3), 1e-15);
}

TEST(Radiometry, EnergyOfThePulseIsAllOnTheWall) {
  // The fluence integrated over stripe and thickness is the pulse: only the fan's length is an arc.
  const SimulatedLaser laser;
  const double sigma_m = thickness_sigma_m(laser, 2.0);
  double sum = 0.0;
  const double step_m = 0.02 * sigma_m;
  for (int n = -400; n <= 400; ++n) {
    const double h = n * step_m;
    sum += peak_fluence_j_m2(laser, 2.0) * std::exp(-0.5 * h * h / (sigma_m * sigma_m)) * step_m;
  }
  EXPECT_NEAR(sum * laser.fan_rad * 2.0, laser.pulse_energy_j, 1e-6 * laser.pulse_energy_j);
}

TEST(Radiometry, PhotonAtNineHundredNanometres) {
  EXPECT_NEAR(photon_energy_j(900.0) / 1.602176634e-19, 1.3776, 1e-4);  // Electron volts.
}

TEST(Radiometry, TiltedWallGetsTheCosineOfTheIncidence) {
  Scene square = paper_in_sun(2.0);
  Scene tilted = square;
  tilted.objects[0].T_world_object.linear() = facing({-1.0, 0.0, 1.0});
  const auto sun_dn = [](const Scene& scene) {
    return Simulator(scene).expected_dn(0).at<float>(239, 320) - scene.imager.black_level_dn;
  };
  EXPECT_NEAR(sun_dn(tilted) / sun_dn(square), std::cos(45.0 * kDegree), 1e-5);
}

TEST(Radiometry, RatioOfALaserThatIsNotThereIsRefused) {
  const Error error = testing::error_of([&] { stripe_to_sun_ratio(Scene(), 1, 2.0); });
  EXPECT_STREQ(error.what(), "laser 1 - the scene has lasers 0 to 0");
}

}  // namespace
}  // namespace striper
