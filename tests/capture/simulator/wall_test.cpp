// SPDX-License-Identifier: Apache-2.0
// Proves on flat walls that the rendered stripe is the box-integrated Gaussian it should be, to
// 1e-4 of its height, and that the truth agrees with formulas that share no code with the
// simulator. Does not prove anything about noise, occlusion or daylight.
#include <cmath>

#include <gtest/gtest.h>

#include <striper/simulator/radiometry.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/random.hpp"

namespace striper {
namespace {

double phi_integral(double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); }

/// methods of subpixel estimation all start from this: a Gaussian integrated over a pixel.
double integrated_gaussian(double pixel, double center, double sigma, double amplitude) {
  return amplitude * std::sqrt(2.0 * M_PI) * sigma *
         (phi_integral((pixel + 0.5 - center) / sigma) -
          phi_integral((pixel - 0.5 - center) / sigma));
}

/// The largest difference between the rendered stripe and the profile that the truth promises, in
/// units of the amplitude. Leaves out `border` scan lines at either end, where the lens blur brings
/// light from outside the image, of which the simulator knows no more than that it is much the
/// same.
double worst_profile_error(Simulator& simulator, std::size_t border) {
  const cv::Mat image = simulator.expected_dn(0);
  const Truth truth = simulator.truth(0).at(0);
  const double black = simulator.scene().imager.black_level_dn;
  double worst = 0.0;
  for (std::size_t line = border; line < truth.lines.size() - border; ++line) {
    if (truth.lines[line].status != TruthStatus::kVisible) continue;
    const TrueReturn& there = truth.lines[line].brightest;
    if (there.near_edge) continue;
    const bool by_columns = truth.axis == StripeAxis::kColumns;
    const int length = by_columns ? image.rows : image.cols;
    const double center = by_columns ? there.v_px : there.u_px;
    for (int i = 0; i < length; ++i) {
      const int k = static_cast<int>(line);
      const double dn = (by_columns ? image.at<float>(i, k) : image.at<float>(k, i)) - black;
      const double expected = integrated_gaussian(i, center, there.width_px, there.amplitude_dn);
      worst = std::max(worst, std::abs(dn - expected) / there.amplitude_dn);
    }
  }
  return worst;
}

int visible(const Truth& truth) {
  int count = 0;
  for (const TrueLine& line : truth.lines) count += line.status == TruthStatus::kVisible ? 1 : 0;
  return count;
}

TEST(SimulatedWall, RangeIsBaselineTimesCotangentOfAlpha) {
  for (const double distance_m : {1.4, 2.0, 3.7}) {
    Scene scene = Scene::flat_wall(distance_m);
    const double focal_px = scene.camera.fx();
    Simulator simulator(scene);
    const Truth truth = simulator.truth(0).at(0);
    ASSERT_EQ(truth.lines.size(), 640U);
    for (const TrueLine& line : truth.lines) {
      ASSERT_EQ(line.status, TruthStatus::kVisible);
      const TrueReturn& there = line.brightest;
      const double tan_alpha = (there.v_px - 239.5) / focal_px;
      EXPECT_NEAR(0.5 / tan_alpha, distance_m, 1e-9);
      EXPECT_NEAR(there.x_m, distance_m, 1e-9);
      const double tan_beta = (319.5 - there.u_px) / focal_px;
      EXPECT_NEAR(there.bearing_rad, std::atan(tan_beta), 1e-10);
      EXPECT_NEAR(there.range_m, distance_m * std::hypot(1.0, tan_beta), 1e-9);
    }
  }
}

TEST(SimulatedWall, WidthIsTheSheetsAngleSeenThroughTheLens) {
  Scene scene = Scene::flat_wall(2.0);
  scene.imager.blur_sigma_px = 0.5;
  Simulator simulator(scene);
  const Truth truth = simulator.truth(0).at(0);
  for (const TrueLine& line : truth.lines) {
    // The laser plane is as thick as its distance from the laser, along the fan, makes it.
    const double tan_beta = (319.5 - line.brightest.u_px) / scene.camera.fx();
    const double sigma_m = scene.lasers[0].divergence_sigma_rad * 2.0 * std::hypot(1.0, tan_beta);
    const double thickness_px = sigma_m * scene.camera.fx() / 2.0;
    EXPECT_NEAR(line.brightest.width_px, std::hypot(thickness_px, 0.5), 1e-6);
  }
}

TEST(SimulatedWall, AmplitudeFollowsFromTheLightBudget) {
  Scene scene = Scene::flat_wall(2.0);
  Simulator simulator(scene);
  const TrueReturn there = simulator.truth(0).at(0).lines[320].brightest;
  // Written out: pulse over stripe area, Lambert, lens, pixel, photons, gain.
  const double sigma_m = 2.0 * 0.4 * M_PI / 180.0 / std::sqrt(2.0 * M_PI);
  const double fluence = 10.4e-6 / (M_PI / 3.0 * 2.0) / (std::sqrt(2.0 * M_PI) * sigma_m);
  const double radiance = 0.5 / M_PI * fluence;
  const double joules = radiance * M_PI / (4.0 * 1.4 * 1.4) * 0.9 * 0.8 * 9.9e-6 * 9.9e-6;
  const double electrons = joules * 0.3 * 900e-9 / (6.62607015e-34 * 299792458.0);
  EXPECT_NEAR(there.amplitude_dn, 0.05 * electrons, 1e-4 * there.amplitude_dn);
}

TEST(SimulatedWall, StripeIsABoxIntegratedGaussian) {
  for (const double thickness_deg : {0.05, 0.1, 0.2, 0.4}) {
    for (const double blur_px : {0.0, 0.3, 0.8}) {
      Scene scene = Scene::flat_wall(testing::uniform(1.9, 2.1));
      scene.lasers[0].divergence_sigma_rad =
          SimulatedLaser::thickness_to_sigma(thickness_deg * M_PI / 180.0);
      scene.imager.blur_sigma_px = blur_px;
      Simulator simulator(scene);
      EXPECT_EQ(visible(simulator.truth(0).at(0)), 640);
      SCOPED_TRACE(::testing::Message() << thickness_deg << " deg, blur " << blur_px << " px");
      EXPECT_LT(worst_profile_error(simulator, 4), 1e-4);
      EXPECT_LT(worst_profile_error(simulator, 0), 1e-3);
    }
  }
}

}  // namespace
}  // namespace striper
