// SPDX-License-Identifier: Apache-2.0
// Proves what a laser's stated angles mean for its light. The light budget is proved with the
// radiometry, the images with the wall.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <striper/simulator/radiometry.hpp>
#include <striper/simulator/simulated_laser.hpp>

namespace striper {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// Data sheets: so many degrees by so many, and the light in between.
TEST(SimulatedLaser, PeaksAsIfThePulseWereSpreadEvenlyOverTheStatedAngles) {
  SimulatedLaser laser;
  for (const double fan_deg : {30.0, 60.0, 110.0}) {
    for (const double thickness_deg : {0.05, 0.4}) {
      laser.fan_rad = fan_deg * kDegree;
      laser.divergence_sigma_rad = SimulatedLaser::thickness_to_sigma(thickness_deg * kDegree);
      for (const double range_m : {0.5, 2.0, 10.0}) {
        const double patch_m2 = laser.fan_rad * range_m * thickness_deg * kDegree * range_m;
        EXPECT_NEAR(peak_fluence_j_m2(laser, range_m) * patch_m2 / laser.pulse_energy_j, 1.0,
                    1e-12);
      }
    }
  }
}

// Integrated by steps: what a Gaussian of that sigma holds is its peak times the thickness.
TEST(SimulatedLaser, ThicknessIsEnergyOverPeak) {
  for (const double thickness : {1e-3, 0.4 * kDegree, 1.0}) {
    const double sigma = SimulatedLaser::thickness_to_sigma(thickness);
    double energy = 0.0;
    for (int i = -800; i <= 800; ++i) energy += 0.01 * sigma * std::exp(-0.5e-4 * i * i);
    EXPECT_NEAR(energy / thickness, 1.0, 1e-12);
  }
}

TEST(SimulatedLaser, DefaultIsThePapersLine) {
  const SimulatedLaser laser;
  EXPECT_DOUBLE_EQ(laser.fan_rad, 60.0 * kDegree);
  EXPECT_DOUBLE_EQ(laser.divergence_sigma_rad * std::sqrt(2.0 * std::numbers::pi), 0.4 * kDegree);
}

}  // namespace
}  // namespace striper
