// SPDX-License-Identifier: Apache-2.0
// Proves that what a perfect calibration is said to know of a stripe is what the truth of rendered
// scenes has: on walls that face the laser, at each range, for either axis, with a waist, a blur,
// binned and at an angle of the lens where its light falls off. Does not prove anything of tilted
// surfaces, on which the stripe is wider and fainter.
#include <cmath>

#include <gtest/gtest.h>

#include <striper/simulator/ideal_look.hpp>
#include <striper/simulator/simulator.hpp>

namespace striper {
namespace {

// Straight ahead, where a wall across the view faces a level laser.
const TrueReturn& middle_of(const Truth& truth) {
  return truth.lines.at(truth.lines.size() / 2).brightest;
}

// The look at the range of a wall, which is where one of its knots is.
void expect_as_on_a_wall(Scene scene, double distance_m) {
  for (SceneObject& object : scene.objects) object.material.reflectance = kWhitePaper;
  Simulator simulator(scene);
  const Truth truth = simulator.truth(0).at(0);
  const TrueReturn& there = middle_of(truth);
  const StripeLook look = ideal_look(simulator.scene(), 0, distance_m, 2.0 * distance_m);
  ASSERT_GE(look.width_at.size(), 2U);
  ASSERT_EQ(look.amplitude_at.size(), look.width_at.size());
  EXPECT_NEAR(look.width_at[0].range_m, distance_m, 1e-3);
  EXPECT_NEAR(look.width_at[0].width_px, there.width_px, 1e-3 * there.width_px);
  EXPECT_NEAR(look.amplitude_at[0].amplitude_dn, there.amplitude_dn, 1e-3 * there.amplitude_dn);
  EXPECT_FALSE(look.colour.has_value());
}

TEST(IdealLook, IsThatOfTheTruthOnWalls) {
  for (const double distance_m : {1.4, 2.0, 3.7}) {
    SCOPED_TRACE(distance_m);
    expect_as_on_a_wall(Scene::flat_wall(distance_m), distance_m);
  }
}

TEST(IdealLook, KnowsWaistBlurBinningAndFalloff) {
  Scene scene = Scene::flat_wall(2.0);
  scene.lasers[0].waist_sigma_m = 0.004;
  scene.lasers[0].focus_m = 1.0;
  scene.imager.blur_sigma_px = 0.9;
  scene.imager.binning = {2, 2};
  scene.imager.falloff_exponent = 4.0;
  scene.imager.bloom.fraction = 0.05;
  expect_as_on_a_wall(scene, 2.0);
}

TEST(IdealLook, ReachesOverAllThatTheImageShows) {
  const Scene scene = Scene::flat_wall(2.0);
  const StripeLook look = ideal_look(scene, 0);
  ASSERT_GE(look.width_at.size(), 4U);
  ASSERT_TRUE(look.width_px.has_value());
  // The image's lower edge sees the level laser at s / tan(half of the view): CONVENTIONS.md.
  const double nearest_m =
      0.5 / ((scene.camera.height() - 1 - scene.camera.cy()) / scene.camera.fy());
  EXPECT_NEAR(look.width_at.front().range_m, nearest_m, 0.03 * nearest_m);
  EXPECT_GT(look.width_at.back().range_m, 8.0);
  EXPECT_GE(look.amplitude_at.back().amplitude_dn, 1.0);
}

TEST(IdealLook, IsEmptyWhereTheFanDoesNotReachIntoTheImage) {
  Scene scene = Scene::flat_wall(2.0);
  scene.lasers[0].T_device_laser.translation().x() = 1000.0;
  const StripeLook look = ideal_look(scene, 0);
  EXPECT_FALSE(look.width_px.has_value());
  EXPECT_TRUE(look.width_at.empty());
  EXPECT_TRUE(look.amplitude_at.empty());
}

TEST(IdealLook, KnowsNoBrightnessOfALaserThatIsOff) {
  Scene scene = Scene::flat_wall(2.0);
  scene.lasers[0].pulse_energy_j = 1e-15;
  const StripeLook look = ideal_look(scene, 0, 1.0, 2.0);
  EXPECT_FALSE(look.width_at.empty());
  EXPECT_TRUE(look.amplitude_at.empty());
}

TEST(IdealLook, IsInTheModelOfTheSimulator) {
  const Simulator simulator(Scene::flat_wall(2.0));
  const StriperModel model = simulator.model();
  EXPECT_GE(model.lasers.at(0).look.width_at.size(), 2U);
  model.validate();
}

}  // namespace
}  // namespace striper
