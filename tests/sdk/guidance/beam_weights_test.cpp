// SPDX-License-Identifier: Apache-2.0
// Proves that the weights give the report's printed errors on its 50 ft radius, are exact on any
// polynomial of their degree, and refuse beams that determine nothing. Does not prove what the
// error is on roads whose curvature changes.
#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/guidance/beam_weights.hpp>

namespace striper {
namespace {

constexpr double kMetresPerFoot = 0.3048;
constexpr double kInchesPerMetre = 1 / 0.0254;

// The stripe is a circle that touches the vehicle's axis at the gun, where it is at 0.
double error_in(const std::vector<double>& beams_ft) {
  constexpr double kRadiusFt = 50.0;
  std::vector<double> x_m;
  std::vector<double> y_m;
  for (const double x_ft : beams_ft) {
    x_m.push_back(x_ft * kMetresPerFoot);
    y_m.push_back((kRadiusFt - std::sqrt(kRadiusFt * kRadiusFt - x_ft * x_ft)) * kMetresPerFoot);
  }
  const std::vector<double> weights = beam_weights(x_m);
  return std::inner_product(y_m.begin(), y_m.end(), weights.begin(), 0.0) * kInchesPerMetre;
}

TEST(BeamWeights, GiveTheReportsErrorsOnACurve) {
  EXPECT_NEAR(error_in({8, -8}), 7.7298, 5e-5);       // printed: 7.73 in
  EXPECT_NEAR(error_in({8, 5, -8}), -0.01955, 5e-6);  // printed: less than 0.02 in
}

TEST(BeamWeights, OfTheReportsBeamsAmplifyNoise) {
  const std::vector<double> weights = beam_weights(std::vector<double>{8, 5, -8});
  EXPECT_NEAR(weights[0], -5.0 / 6, 1e-12);
  EXPECT_NEAR(weights[1], 64.0 / 39, 1e-12);
  EXPECT_NEAR(weights[2], 5.0 / 26, 1e-12);
  EXPECT_NEAR(std::hypot(weights[0], weights[1], weights[2]), 1.85, 0.005);
}

TEST(BeamWeights, AreExactOnAParabola) {
  const std::vector<double> x_m = {2.4, 1.5, -2.4};
  const auto path = [](double x) { return 0.03 * x * x - 0.2 * x + 0.11; };
  for (const double at_m : {-3.0, 0.0, 0.7, 1.5, 9.0}) {
    const std::vector<double> weights = beam_weights(x_m, at_m);
    double y_m = 0;
    for (std::size_t i = 0; i < x_m.size(); ++i) y_m += weights[i] * path(x_m[i]);
    EXPECT_NEAR(y_m, path(at_m), 1e-12) << at_m;
  }
}

TEST(BeamWeights, OfOneBeamIsAParallel) {
  EXPECT_EQ(beam_weights(std::vector<double>{2.4}), std::vector<double>{1.0});
}

TEST(BeamWeights, RefuseWhatDeterminesNothing) {
  EXPECT_THROW(beam_weights(std::vector<double>{}), Error);
  EXPECT_THROW(beam_weights(std::vector<double>{2.4, 2.4}), Error);
  EXPECT_THROW(beam_weights(std::vector<double>{NAN}), Error);
}

}  // namespace
}  // namespace striper
