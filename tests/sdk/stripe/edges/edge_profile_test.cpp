// SPDX-License-Identifier: Apache-2.0
// Proves that a stripe across an edge of reflectance is where the fit says, as well as it says,
// clipped or not, with a dark exposure or not: against a profile that is convolved by numbers, of
// noise with fixed seeds. And that a clipped pixel says that at least so much light is there. Does
// not prove which scan lines have an edge, nor what a lens with another blur does.
#include "stripe/edges/edge_profile.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/robust.hpp>

#include "support/edge_light.hpp"
#include "support/random.hpp"

namespace striper::detail {
namespace {

constexpr double kBlack_dn = 5.0;
constexpr double kAmbient_dn = 60.0;  // Mean of both sides.
constexpr double kContrast = 0.8;
constexpr double kBlur_px = 0.45;
constexpr double kWidth_px = 1.6;
constexpr double kReadNoise_dn = 1.0;
constexpr double kDnPerElectron = 0.02;
constexpr int kPixels = 24;
// What is not known of them; the truth is drawn by that.
constexpr double kBlackSigma_dn = 0.5;
constexpr double kBlurSigma_px = 0.1;
constexpr double kWidthSigma_px = 0.07;

struct Case {
  std::string name;
  double amplitude_dn = 100.0;  // Where the reflectance is the mean of both sides.
  double edge_px = 0.5;         // From the stripe's middle, pixels across.
  double full_scale_dn = 1e9;
  bool has_dark = false;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class Trials {
 public:
  explicit Trials(const Case& c) : case_(c) {
    noise_.model.read_noise_dn = kReadNoise_dn;
    noise_.model.dn_per_electron = kDnPerElectron;
    noise_.model.black_level_dn = kBlack_dn;
    noise_.dark_noise_gain = c.has_dark ? 1.0 : 0.0;
  }

  // The fit of one profile, its stripe anywhere in a pixel.
  EdgeEstimate fit(double position) {
    const EdgeProfile profile = profile_at(position);
    EdgePrior prior;
    auto& mean = prior.mean.of;
    mean[EdgeModel::kPosition] = mean[EdgeModel::kEdge] = std::round(position);
    mean[EdgeModel::kAmplitude] = case_.amplitude_dn;
    mean[EdgeModel::kAmbient] = kAmbient_dn;
    mean[EdgeModel::kBlack] = kBlack_dn;
    mean[EdgeModel::kBlur] = kBlur_px;
    mean[EdgeModel::kWidth] = kWidth_px;
    prior.sigma[EdgeModel::kPosition] = 2.0 * kWidth_px;
    prior.sigma[EdgeModel::kEdge] = 6.0;
    prior.sigma[EdgeModel::kContrast] = 0.6;
    prior.sigma[EdgeModel::kBlack] = kBlackSigma_dn;
    prior.sigma[EdgeModel::kSlope] = 0.5;
    prior.sigma[EdgeModel::kBlur] = kBlurSigma_px;
    prior.sigma[EdgeModel::kWidth] = kWidthSigma_px;
    EdgeModel start = prior.mean;
    start.of[EdgeModel::kContrast] = 0.5;  // Which of several starts is best is another's to know.
    start.of[EdgeModel::kEdge] += case_.edge_px;
    constexpr int kSteps = 200;
    return fit_edge(profile, noise_, prior, start, EdgeKind::kReflectance, kSteps);
  }

  EdgeProfile profile_at(double position) {
    const double edge = position + case_.edge_px;
    const double blur_px = std::max(0.2, testing::normal(kBlur_px, kBlurSigma_px));
    const double width_px = testing::normal(kWidth_px, kWidthSigma_px);
    const double black_dn = testing::normal(kBlack_dn, kBlackSigma_dn);
    const double laser_sigma = std::sqrt(width_px * width_px - blur_px * blur_px);
    const double height = case_.amplitude_dn * width_px / laser_sigma;
    const auto side = [&](double x) { return 1.0 + (x > edge ? kContrast : -kContrast); };
    const auto laser = [&](double x) {
      const double z = (x - position) / laser_sigma;
      return height * std::exp(-0.5 * z * z);
    };
    EdgeProfile profile;
    profile.has_dark = case_.has_dark;
    for (int k = 0; k < kPixels; ++k) {
      const double background =
          black_dn + kAmbient_dn * testing::seen_of_edge(side, edge, k, blur_px);
      const double light =
          background +
          testing::seen_of_edge([&](double x) { return laser(x) * side(x); }, edge, k, blur_px);
      profile.at[profile.count] = k;
      const double lit = noisy(light);
      profile.clipped[profile.count] = lit >= case_.full_scale_dn;
      profile.is_clipped = profile.is_clipped || profile.clipped[profile.count];
      profile.lit[profile.count] = std::min(lit, case_.full_scale_dn);
      profile.dark[profile.count] = case_.has_dark ? noisy(background) : 0.0;
      profile.extra[profile.count] = 0.0;
      ++profile.count;
    }
    return profile;
  }

  const PlanNoise& noise() const { return noise_; }

 private:
  double noisy(double dn) {
    return dn + testing::normal(0.0, std::sqrt(noise_.model.variance_dn2(dn)));
  }

  Case case_;
  PlanNoise noise_;
};

class AStripeAcrossAnEdge : public ::testing::TestWithParam<Case> {};

TEST_P(AStripeAcrossAnEdge, IsAsFarOffAsTheFitSays) {
  constexpr int kTrials = 300;
  Trials trials(GetParam());
  std::vector<double> pulls;
  std::vector<double> errors;
  double mean_pull = 0.0;
  int clipped = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const double position = 12.0 + trial / static_cast<double>(kTrials);
    clipped += trials.profile_at(position).is_clipped ? 1 : 0;
    const EdgeEstimate found = trials.fit(position);
    ASSERT_GT(found.variance, 0.0);
    const double error_px = found.model.of[EdgeModel::kPosition] - position;
    mean_pull += error_px / std::sqrt(found.variance) / kTrials;
    errors.push_back(std::abs(error_px));
    pulls.push_back(errors.back() / std::sqrt(found.variance));
  }
  EXPECT_EQ(clipped, GetParam().full_scale_dn < 1e9 ? kTrials : 0);
  const double error_px = robust_sigma(errors);
  const double pull = robust_sigma(pulls);
  std::cout << "pull " << pull << " (mean " << mean_pull << "), error " << error_px << " px\n";
  EXPECT_NEAR(pull, 1.0, 0.2);
  EXPECT_NEAR(mean_pull, 0.0, 0.3);
  EXPECT_LT(error_px, 0.2);
}

INSTANTIATE_TEST_SUITE_P(
    EdgeProfile, AStripeAcrossAnEdge,
    ::testing::Values(Case{"Whole"}, Case{"EdgeBefore", 100.0, -1.0}, Case{"EdgeAfter", 100.0, 1.6},
                      Case{"Clipped", 300.0, 0.5, 255.0}, Case{"ClippedBefore", 300.0, -1.0, 255.0},
                      Case{"ClippedAfter", 600.0, 1.6, 255.0}, Case{"Dark", 100.0, 0.5, 1e9, true},
                      Case{"ClippedWithDark", 300.0, 0.5, 255.0, true}),
    [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace striper::detail
