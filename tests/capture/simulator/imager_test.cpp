// SPDX-License-Identifier: Apache-2.0
// Proves the statistics of each noise by itself: Poisson by chi-square, the photon-transfer line,
// normal read noise, fixed pattern, speckle, rounding and clipping; that every one of them can be
// switched off alone; and bloom and falloff of the lens. Region and binning are proved with
// determinism. Does not prove that a real sensor is like this.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/simulator/imager.hpp>
#include <striper/simulator/simulator.hpp>

#include "capture/simulator/lit_scene.hpp"

namespace striper {
namespace {

using testing::lit_scene;
using testing::object;

/// An evenly lit wall that puts `electrons` into every pixel, no laser, every noise off.
Scene even_light(double electrons) {
  Scene scene = Scene::flat_wall(2.0);
  scene.lasers[0].pulse_energy_j = 0.0;
  scene.imager.bit_depth = 16;
  scene.imager.dn_per_electron = 1.0;
  scene.imager.black_level_dn = 0.0;
  scene.imager.noise = {.shot = false, .read_noise_e = 0.0};
  scene.daylight.ambient_w_m2_nm = 1.0;
  const double per_unit = Simulator(scene).expected_dn(0).at<float>(0, 0);
  scene.daylight.ambient_w_m2_nm = electrons / per_unit;
  return scene;
}

struct Moments {
  double mean;
  double variance;
};

Moments moments(const cv::Mat& image) {
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(image, mean, deviation);
  return {mean[0], deviation[0] * deviation[0]};
}

/// Chi-square of counts against a Poisson law, in standard deviations from its expectation; bins of
/// fewer than 10 expected counts are left out.
double poisson_chi_square_sigmas(const cv::Mat& image, double mean) {
  std::vector<double> counts(65536, 0.0);
  for (const std::uint16_t value : cv::Mat_<std::uint16_t>(image)) counts[value] += 1.0;
  double chi2 = 0.0;
  int bins = 0;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const auto n = static_cast<double>(k);
    const double expected = static_cast<double>(image.total()) *
                            std::exp(n * std::log(mean) - mean - std::lgamma(n + 1.0));
    if (expected < 10.0) continue;
    chi2 += (counts[k] - expected) * (counts[k] - expected) / expected;
    ++bins;
  }
  return (chi2 - bins) / std::sqrt(2.0 * bins);
}

TEST(SimulatedNoise, ShotNoiseIsPoisson) {
  // Means on both sides of 10, where the method changes, and large ones.
  for (const double mean : {0.3, 3.0, 9.9, 10.1, 40.0, 150.0, 1000.0, 20000.0}) {
    Scene scene = even_light(mean);
    scene.imager.noise.shot = true;
    EXPECT_LT(std::abs(poisson_chi_square_sigmas(Simulator(scene).render(0).image, mean)), 4.0)
        << "mean " << mean;
  }
}

TEST(SimulatedNoise, ReadNoiseIsNormal) {
  Scene scene = even_light(1000.0);
  scene.imager.noise.read_noise_e = 7.0;
  const cv::Mat image = Simulator(scene).render(0).image;
  const Moments found = moments(image);
  const auto n = static_cast<double>(image.total());
  const double variance = 49.0 + 1.0 / 12.0;  // Rounding adds its twelfth.
  EXPECT_NEAR(found.mean, 1000.0, 4.0 * std::sqrt(variance / n));
  EXPECT_NEAR(found.variance, variance, 4.0 * variance * std::sqrt(2.0 / n));
  double beyond_2_sigma = 0.0;
  double fourth = 0.0;
  for (const std::uint16_t value : cv::Mat_<std::uint16_t>(image)) {
    const double z = (value - 1000.0) / std::sqrt(variance);
    beyond_2_sigma += std::abs(z) > 13.5 / std::sqrt(variance) ? 1.0 : 0.0;
    fourth += z * z * z * z / n;
  }
  // P(|7 z + rounding| > 13.5) = P(rounded value at least 14 off).
  const double tail = std::erfc(13.5 / 7.0 / std::sqrt(2.0));
  EXPECT_NEAR(beyond_2_sigma / n, tail, 4.0 * std::sqrt(tail / n));
  EXPECT_NEAR(fourth, 3.0, 4.0 * std::sqrt(96.0 / n) + 0.005);
}

TEST(SimulatedNoise, VarianceIsThePhotonTransferLineOfTheModel) {
  for (const double mean_e : {20.0, 200.0, 2000.0, 15000.0}) {
    Scene scene = even_light(mean_e);
    scene.imager.noise = {.shot = true, .read_noise_e = 12.0};
    scene.imager.dn_per_electron = 0.2;
    scene.imager.black_level_dn = 100.0;
    scene.imager.bit_depth = 12;
    Simulator simulator(scene);
    const Moments found = moments(simulator.render(3).image);
    const double expected = simulator.model().noise->variance_dn2(100.0 + 0.2 * mean_e);
    EXPECT_NEAR(found.mean, 100.0 + 0.2 * mean_e, 4.0 * std::sqrt(expected / 307200.0));
    EXPECT_NEAR(found.variance, expected, 4.0 * expected * std::sqrt(2.0 / 307200.0));
  }
}

TEST(SimulatedNoise, FixedPatternIsTheSameInEveryImage) {
  Scene scene = even_light(10000.0);
  scene.imager.noise.prnu = 0.02;
  Simulator simulator(scene);
  const cv::Mat first = simulator.render(0).image;
  EXPECT_EQ(cv::norm(first, simulator.render(5).image, cv::NORM_INF), 0.0);
  const Moments found = moments(first);
  EXPECT_NEAR(std::sqrt(found.variance) / found.mean, 0.02, 1e-4);
}

TEST(SimulatedNoise, SpeckleMultipliesTheLasersLightOnly) {
  Scene scene = even_light(1000.0);
  scene.lasers[0] = SimulatedLaser{};
  scene.lasers[0].pulse_energy_j *= 3.0;
  Simulator plain(scene);
  scene.imager.noise.speckle = 0.1;
  Simulator speckled(scene);
  const cv::Mat smooth = plain.expected_dn(0);
  double sum = 0.0;
  double sum2 = 0.0;
  double product = 0.0;
  int count = 0;
  for (int number = 0; number < 8; number += 2) {
    const cv::Mat_<std::uint16_t> rough = speckled.render(number).image;
    const cv::Mat_<std::uint16_t> other = speckled.render(number + 1).image;
    for (int row = 0; row < smooth.rows; ++row) {
      for (int column = 0; column < smooth.cols; ++column) {
        const double laser = smooth.at<float>(row, column) - 1000.0;
        if (laser < 1e-2) {
          ASSERT_EQ(rough(row, column), 1000);
        }
        if (laser < 1000.0) continue;
        const double relative = (rough(row, column) - smooth.at<float>(row, column)) / laser;
        sum += relative;
        sum2 += relative * relative;
        product += relative * (other(row, column) - smooth.at<float>(row, column)) / laser;
        ++count;
      }
    }
  }
  ASSERT_GT(count, 5000);
  EXPECT_NEAR(sum / count, 0.0, 4.0 * 0.1 / std::sqrt(count));
  EXPECT_NEAR(std::sqrt(sum2 / count), 0.1, 4.0 * 0.1 / std::sqrt(2.0 * count));
  EXPECT_NEAR(product / count, 0.0, 4.0 * 0.01 / std::sqrt(count));  // New in every exposure.
}

TEST(SimulatedNoise, ImagesAndPixelsAreIndependent) {
  Scene scene = even_light(400.0);
  scene.imager.noise.shot = true;
  Simulator simulator(scene);
  cv::Mat a;
  cv::Mat b;
  simulator.render(0).image.convertTo(a, CV_64F, 1.0 / 20.0, -20.0);
  simulator.render(1).image.convertTo(b, CV_64F, 1.0 / 20.0, -20.0);
  const double bound = 4.0 / std::sqrt(static_cast<double>(a.total()));
  EXPECT_NEAR(a.dot(b) / static_cast<double>(a.total()), 0.0, bound);
  const cv::Mat left = a.colRange(0, a.cols - 1);
  const cv::Mat right = a.colRange(1, a.cols);
  EXPECT_NEAR(left.dot(right) / static_cast<double>(left.total()), 0.0, bound);
  const cv::Mat upper = a.rowRange(0, a.rows - 1);
  const cv::Mat lower = a.rowRange(1, a.rows);
  EXPECT_NEAR(upper.dot(lower) / static_cast<double>(upper.total()), 0.0, bound);
}

TEST(SimulatedNoise, SwitchingOneOffLeavesTheOthersAsTheyAre) {
  Scene scene = even_light(1000.0);
  scene.imager.noise = {.shot = false, .read_noise_e = 30.0};
  cv::Mat read_only;
  Simulator(scene).render(4).image.convertTo(read_only, CV_32S);
  scene.imager.noise.shot = true;
  cv::Mat both;
  Simulator(scene).render(4).image.convertTo(both, CV_32S);
  scene.imager.noise.read_noise_e = 0.0;
  cv::Mat shot_only;
  Simulator(scene).render(4).image.convertTo(shot_only, CV_32S);
  // The noises are added before rounding, so the sum is right to one count.
  EXPECT_LE(cv::norm(both - 1000, read_only - 1000 + shot_only - 1000, cv::NORM_INF), 1.0);
}

TEST(SimulatedNoise, WithoutAnyNoiseAnImageIsItsExpectationRounded) {
  Scene scene = Scene::flat_wall(2.0);
  scene.imager.noise = {.shot = false, .read_noise_e = 0.0};
  Simulator simulator(scene);
  cv::Mat rounded;
  simulator.expected_dn(0).convertTo(rounded, CV_8U);
  EXPECT_LE(cv::countNonZero(rounded != simulator.render(0).image), 2);  // Ties round differently.
  EXPECT_EQ(cv::norm(simulator.render(0).image, simulator.render(9).image, cv::NORM_INF), 0.0);
}

TEST(SimulatedSensor, ClipsAtFullScaleAndAtFullWell) {
  for (const int bits : {8, 10, 12, 16}) {
    Scene scene = even_light(1e6);
    scene.imager.bit_depth = bits;
    const Frame frame = Simulator(scene).render(0);
    EXPECT_EQ(frame.bit_depth, bits);
    EXPECT_EQ(frame.image.depth(), bits > 8 ? CV_16U : CV_8U);
    EXPECT_EQ(cv::countNonZero(frame.image != frame.full_scale_dn()), 0);
  }
  Scene scene = even_light(1e6);
  scene.imager.full_well_e = 20000.0;
  EXPECT_EQ(cv::countNonZero(Simulator(scene).render(0).image != 20000), 0);
}

TEST(SimulatedSensor, BlackLevelAndGainAreALine) {
  Scene scene = even_light(1000.0);
  scene.imager.dn_per_electron = 0.25;
  scene.imager.black_level_dn = 64.0;
  EXPECT_EQ(cv::countNonZero(Simulator(scene).render(0).image != 64 + 250), 0);
}

TEST(SimulatedSensor, FullShutterLetsInProportionallyMoreDaylight) {
  Scene scene = even_light(100.0);
  scene.imager.shutter_s *= 40.0;
  EXPECT_NEAR(moments(Simulator(scene).expected_dn(0)).mean, 4000.0, 0.01);
}

TEST(SimulatedLens, BloomSpreadsLightAndLosesNone) {
  Scene scene = lit_scene();
  scene.daylight.ambient_w_m2_nm = 0.0;
  scene.objects.push_back(object(Disc{0.02}, {2.0, 0.0, 0.0}));
  scene.objects[0].material.radiance_w_m2_sr_nm = 10.0;
  const cv::Mat sharp = Simulator(scene).expected_dn(0);
  scene.imager.bloom = {.fraction = 0.05, .sigma_px = 6.0};
  const cv::Mat soft = Simulator(scene).expected_dn(0);
  EXPECT_NEAR(cv::sum(soft)[0] / cv::sum(sharp)[0], 1.0, 1e-5);
  EXPECT_EQ(sharp.at<float>(240, 340), 0.0F);
  EXPECT_GT(soft.at<float>(240, 340), 0.0F);
  // A disc of radius 0.02 m at 2 m covers pi r^2 f^2 / d^2 pixels.
  const double pixels = M_PI * std::pow(0.02 * scene.camera.fx() / 2.0, 2);
  EXPECT_NEAR(cv::sum(sharp)[0] / sharp.at<float>(240, 320), pixels, 0.02 * pixels);
}

TEST(SimulatedLens, FalloffIsThePowerOfTheCosine) {
  Scene scene = lit_scene();
  scene.objects.push_back(object(Plane{}, {2.0, 0.0, 0.0}));
  scene.imager.falloff_exponent = 4.0;
  const cv::Mat image = Simulator(scene).expected_dn(0);
  const double tan_theta = (600.0 - 319.5) / scene.camera.fx();
  const double cos_theta = 1.0 / std::sqrt(1.0 + tan_theta * tan_theta);
  EXPECT_NEAR(image.at<float>(239, 600) / image.at<float>(239, 319), std::pow(cos_theta, 4), 1e-4);
}

}  // namespace
}  // namespace striper
