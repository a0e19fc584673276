// SPDX-License-Identifier: Apache-2.0
// Proves the Cramer-Rao bound against the closed forms for white and shot noise, their mixture, a
// background slope as a nuisance and masked clipped pixels. Does not prove that an estimator
// reaches it: stripe_accuracy_test.cpp does.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <striper/stripe/crlb.hpp>

namespace striper {
namespace {

StripeProfile profile_of(double sigma_px, double amplitude_dn) {
  StripeProfile profile;
  profile.sigma_px = sigma_px;
  profile.amplitude_dn = amplitude_dn;
  return profile;
}

CrlbOptions window_of(double half_width) {
  CrlbOptions options;
  options.first_pixel = -static_cast<int>(std::ceil(half_width));
  options.last_pixel = -options.first_pixel;
  return options;
}

CrlbOptions white(double noise_dn, double half_width) {
  CrlbOptions options = window_of(half_width);
  options.noise.read_noise_dn = std::sqrt(noise_dn * noise_dn - 1.0 / 12.0);
  return options;
}

TEST(Crlb, ProfileIsTheIntegralOfTheGaussianOverThePixel) {
  const StripeProfile profile{0.3, 50.0, 0.8, 10.0, 0.5};
  const auto simpson = [&](int i) {
    double sum = 0.0;
    constexpr int kSteps = 200;
    for (int n = 0; n <= kSteps; ++n) {
      const double x = i - 0.5 + static_cast<double>(n) / kSteps - profile.position_px;
      const double weight = n == 0 || n == kSteps ? 1.0 : (n % 2 == 1 ? 4.0 : 2.0);
      sum += weight * std::exp(-0.5 * x * x / (profile.sigma_px * profile.sigma_px));
    }
    return 10.0 + 0.5 * i + 50.0 * sum / (3.0 * kSteps);
  };
  for (int i = -4; i <= 4; ++i) EXPECT_NEAR(profile.value_dn(i), simpson(i), 1e-7);
}

TEST(Crlb, DerivativeIsThatOfTheValue) {
  StripeProfile profile{0.2, 80.0, 0.9, 0.0, 0.0};
  constexpr double kStep = 1e-5;
  for (int i = -4; i <= 4; ++i) {
    StripeProfile before = profile;
    StripeProfile after = profile;
    before.position_px -= kStep;
    after.position_px += kStep;
    EXPECT_NEAR(profile.derivative(i), (after.value_dn(i) - before.value_dn(i)) / (2 * kStep),
                1e-6);
  }
}

TEST(Crlb, WhiteNoiseAgreesWithTheClosedForm) {
  for (const double sigma : {1.0, 1.5, 2.0, 3.0}) {
    const double bound = crlb_sigma_px(profile_of(sigma, 1000.0), white(20.0, 10.0 * sigma));
    EXPECT_NEAR(bound / white_noise_bound_px(sigma, 50.0), 1.0, 0.003) << sigma;
  }
  // Sampling begins to tell: 1 % at a sigma of 0.7 pixels, in the mean over the phase.
  double sum = 0.0;
  for (int n = 0; n < 16; ++n) {
    StripeProfile profile = profile_of(0.7, 1000.0);
    profile.position_px = (n + 0.5) / 16.0 - 0.5;
    sum += std::pow(crlb_sigma_px(profile, white(20.0, 10.0)), 2.0) / 16.0;
  }
  EXPECT_NEAR(std::sqrt(sum) / white_noise_bound_px(0.7, 50.0), 1.011, 0.004);
}

TEST(Crlb, ShotNoiseAgreesWithTheClosedForm) {
  for (const double sigma : {1.0, 1.5, 3.0}) {
    CrlbOptions options = window_of(12.0 * sigma);
    options.noise.dn_per_electron = 1e6;  // So that quantisation and read noise do not count.
    const double bound = crlb_sigma_px(profile_of(sigma, 1e10), options);
    EXPECT_NEAR(bound / shot_noise_bound_px(sigma, 1e10, 1e6), 1.0, 0.01) << sigma;
  }
}

TEST(Crlb, MixedNoiseAgreesWithItsTable) {
  // In units of sqrt(sigma variance) / amplitude, by rho = shot over background variance.
  struct Row {
    double rho;
    double value;
  };
  constexpr double kSigma = 4.0;
  constexpr double kAmplitude = 1e4;
  for (const Row& row : {Row{0.1, 1.0905}, Row{1.0, 1.3033}, Row{3.0, 1.6487}, Row{10.0, 2.4376}}) {
    CrlbOptions options = white(100.0, 10.0 * kSigma);
    options.noise.dn_per_electron = row.rho * 1e4 / kAmplitude;
    const double bound = crlb_sigma_px(profile_of(kSigma, kAmplitude), options);
    EXPECT_NEAR(bound / (std::sqrt(kSigma) * 100.0 / kAmplitude), row.value, 0.01 * row.value);
  }
}

TEST(Crlb, SlopeAsANuisanceCostsWhatTheWindowSays) {
  constexpr double kSigma = 3.0;
  for (const double widths : {8.0, 12.0, 14.0}) {
    const double half = 0.5 * widths * kSigma;
    CrlbOptions options = white(20.0, half);
    const double without = crlb_sigma_px(profile_of(kSigma, 1000.0), options);
    options.slope_is_known = false;
    const double with = crlb_sigma_px(profile_of(kSigma, 1000.0), options);
    const double window = 2.0 * std::ceil(half) + 1.0;
    const double expected =
        1.0 / std::sqrt(1.0 - 48.0 * std::sqrt(std::numbers::pi) * std::pow(kSigma / window, 3.0));
    EXPECT_NEAR(with / without, expected, 0.012) << widths;
  }
}

TEST(Crlb, EvenNuisancesCostNothingWhereTheSamplingIsFine) {
  CrlbOptions options = white(20.0, 30.0);
  const double unknown = crlb_sigma_px(profile_of(2.0, 1000.0), options);
  options.width_is_known = true;
  EXPECT_NEAR(unknown / crlb_sigma_px(profile_of(2.0, 1000.0), options), 1.0, 1e-6);
}

TEST(Crlb, MaskedClippedPixelsLoseNothingOfAWideStripe) {
  // Relative to the stripe that just fits, at the same full scale and noise.
  const auto bound = [](double sigma, double times) {
    CrlbOptions options = white(12.75, 10.0 * sigma);
    options.full_scale_dn = 255.0;
    double sum = 0.0;
    for (int n = 0; n < 16; ++n) {
      StripeProfile profile = profile_of(sigma, 255.0 * times);
      profile.position_px = (n + 0.5) / 16.0 - 0.5;
      sum += std::pow(crlb_sigma_px(profile, options), 2.0) / 16.0;
    }
    return std::sqrt(sum);
  };
  EXPECT_NEAR(bound(1.0, 2.0) / bound(1.0, 1.0), 1.06, 0.05);
  EXPECT_NEAR(bound(1.5, 2.0) / bound(1.5, 1.0), 0.86, 0.04);
  EXPECT_NEAR(bound(3.0, 5.0) / bound(3.0, 1.0), 0.72, 0.04);
}

TEST(Crlb, WithoutInformationItIsInfinite) {
  CrlbOptions options = white(2.0, 10.0);
  EXPECT_TRUE(std::isinf(crlb_sigma_px(profile_of(1.5, 0.0), options)));
  options.full_scale_dn = 0.5;
  StripeProfile dazzled = profile_of(1.5, 100.0);
  dazzled.background_dn = 1.0;
  EXPECT_TRUE(std::isinf(crlb_sigma_px(dazzled, options)));
}

}  // namespace
}  // namespace striper
