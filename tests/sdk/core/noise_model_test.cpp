// SPDX-License-Identifier: Apache-2.0
// Proves the photon-transfer line against pixels that are drawn electron by electron, and what
// becomes of it in images of another bit depth. That it is found again from images is proved
// with `PhotonTransfer`.
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <striper/core/noise_model.hpp>

#include "support/random.hpp"

namespace striper {
namespace {

constexpr NoiseModel kOf8Bits{1.5, 0.06, 6.0, 8};

// Variance of `count` pixels of one light: Poisson electrons, amplified, read and rounded.
double drawn_variance_dn2(const NoiseModel& noise, double value_dn, int count) {
  const double electrons = (value_dn - noise.black_level_dn) / noise.dn_per_electron;
  std::poisson_distribution<int> shot(electrons);
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < count; ++i) {
    const double light_dn = noise.dn_per_electron * shot(testing::random_generator());
    const double read_dn = testing::normal(noise.black_level_dn, noise.read_noise_dn);
    const double off_dn = std::round(light_dn + read_dn) - value_dn;
    sum += off_dn;
    squares += off_dn * off_dn;
  }
  return (squares - sum * sum / count) / (count - 1);
}

TEST(NoiseModel, VarianceIsThatOfPixelsDrawnElectronByElectron) {
  constexpr int kPixels = 100'000;
  // A sample variance scatters by sqrt(2 / n) of itself; 1/12 DN^2 alone is 20 times that.
  constexpr double kFourSigmas = 4.0 * 1.4142 / 316.2;
  for (const double value_dn : {10.0, 40.0, 200.0}) {
    const double expected_dn2 = kOf8Bits.variance_dn2(value_dn);
    EXPECT_NEAR(drawn_variance_dn2(kOf8Bits, value_dn, kPixels), expected_dn2,
                kFourSigmas * expected_dn2);
  }
}

TEST(NoiseModel, DarkerThanBlackThereIsNoShotNoise) {
  for (const double value_dn : {-100.0, 0.0, 6.0}) {
    EXPECT_DOUBLE_EQ(kOf8Bits.variance_dn2(value_dn), 1.5 * 1.5 + 1.0 / 12.0) << value_dn;
  }
  EXPECT_DOUBLE_EQ(NoiseModel{}.variance_dn2(200.0), 1.0 / 12.0) << "quantisation is always there";
}

TEST(NoiseModel, AnotherDepthScalesAllButTheQuantisation) {
  const NoiseModel of_12_bits = kOf8Bits.at_bit_depth(12);
  EXPECT_EQ(of_12_bits, (NoiseModel{24.0, 0.96, 96.0, 12}));
  for (const double value_dn : {0.0, 6.0, 7.0, 255.0}) {
    EXPECT_DOUBLE_EQ(of_12_bits.variance_dn2(16.0 * value_dn) - 1.0 / 12.0,
                     256.0 * (kOf8Bits.variance_dn2(value_dn) - 1.0 / 12.0));
  }
  EXPECT_EQ(of_12_bits.at_bit_depth(8), kOf8Bits) << "and back";
  EXPECT_EQ(kOf8Bits.at_bit_depth(8), kOf8Bits);
}

TEST(NoiseModel, ThatDoesNotSayItsDepthStaysAsItIs) {
  const NoiseModel unsaid{1.5, 0.06, 6.0};
  EXPECT_EQ(unsaid.at_bit_depth(12), unsaid);
}

TEST(NoiseModel, LikelyDepthIsTheOneWhoseVarianceIsNearer) {
  const NoiseModel unsaid{1.5, 0.06, 6.0};
  const NoiseModel scaled = kOf8Bits.at_bit_depth(12);
  constexpr double kValueDn = 400.0;
  // Nearer by ratio: the border is the geometric mean of the two variances.
  const double border_dn2 =
      std::sqrt(unsaid.variance_dn2(kValueDn) * scaled.variance_dn2(kValueDn));
  EXPECT_EQ(unsaid.at_likely_depth(12, 0.99 * border_dn2, kValueDn), unsaid);
  EXPECT_EQ(unsaid.at_likely_depth(12, 1.01 * border_dn2, kValueDn), scaled);
}

TEST(NoiseModel, LikelyDepthIsItsOwnWhereNothingSpeaksForAnother) {
  const NoiseModel unsaid{1.5, 0.06, 6.0};
  EXPECT_EQ(unsaid.at_likely_depth(8, 1e6, 100.0), unsaid) << "as deep as images can be at least";
  for (const double unknown :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(unsaid.at_likely_depth(12, unknown, 400.0), unsaid);
  }
  // What is said is believed, whatever the images show.
  EXPECT_EQ(kOf8Bits.at_likely_depth(12, 0.0, 400.0), kOf8Bits.at_bit_depth(12));
  EXPECT_EQ((NoiseModel{1.5, 0.06, 6.0, 12}).at_likely_depth(12, 1e6, 400.0),
            (NoiseModel{1.5, 0.06, 6.0, 12}));
}

}  // namespace
}  // namespace striper
