// SPDX-License-Identifier: Apache-2.0
// Proves over hundreds of simulated calibrations (points alone, true model) that the range error of
// the calibration is as small as the information in the points allows, and that the covariance
// says how large it is. Does not prove anything about images or about lenses that no model fits.
#include <gtest/gtest.h>

#include "monte_carlo_support.hpp"

namespace striper {
namespace {

using testing::SyntheticStriper;

struct Spread {
  std::vector<double> error_m[3];
  std::vector<double> pull[3];
  std::vector<double> sigma_m[3];
  std::vector<double> mahalanobis_p;
  double corner_chi2 = 0.0, corner_dof = 0.0;
  double stripe_chi2 = 0.0, stripe_dof = 0.0;
};

constexpr double kRanges_m[3] = {1.0, 2.0, 4.0};

const std::vector<int> kFreeCamera = {0, 1, 2, 3, 4, 5, 6, 7, 8};

JointOptions given_sigmas() {
  JointOptions options;
  options.corner_sigma_px = 0.1;
  options.trust_stripe_sigma = true;
  return options;
}

Spread calibrate_many(int calibrations, int boards) {
  const SyntheticStriper striper;
  const StriperModel truth = testing::model_of(striper.camera, striper.plane);
  const Eigen::MatrixXd S = testing::to_free(striper.camera, striper.plane, kFreeCamera);
  const Eigen::VectorXd true_parameters = testing::stacked(striper.camera, striper.plane);
  Spread spread;
  for (int i = 0; i < calibrations; ++i) {
    const JointSolution solution =
        solve_joint(testing::varied_boards(striper, boards), given_sigmas());
    const Triangulator found(testing::model_of(solution), 0);
    for (int r = 0; r < 3; ++r) {
      const Eigen::Vector2d pixel = testing::pixel_at_range(truth, kRanges_m[r]);
      const double error_m = found.triangulate(pixel).range_m() - kRanges_m[r];
      const double sigma_m = found.sigma_cal_m(pixel);
      spread.error_m[r].push_back(error_m);
      spread.sigma_m[r].push_back(sigma_m);
      spread.pull[r].push_back(error_m / sigma_m);
    }
    const Eigen::VectorXd e =
        S * (testing::stacked(solution.camera, solution.planes[0]) - true_parameters);
    const Eigen::MatrixXd C = S * solution.covariance * S.transpose();
    spread.mahalanobis_p.push_back(
        testing::chi2_cdf(e.dot(C.ldlt().solve(e)), static_cast<double>(e.size())));
    spread.corner_chi2 += solution.corners.chi2;
    spread.corner_dof += solution.corners.dof;
    spread.stripe_chi2 += solution.stripes.chi2;
    spread.stripe_dof += solution.stripes.dof;
  }
  return spread;
}

void expect_honest(const Spread& spread, const double (&goal_mm)[3]) {
  for (int r = 0; r < 3; ++r) {
    const double error_mm = 1000.0 * testing::rms(spread.error_m[r]);
    double mean = 0.0;
    for (const double p : spread.pull[r]) mean += p / static_cast<double>(spread.pull[r].size());
    const double pull = std::sqrt(std::pow(testing::rms(spread.pull[r]), 2.0) - mean * mean);
    std::printf("range %.0f m: error %.2f mm rms, predicted %.2f mm rms, pulls %.2f +- %.3f\n",
                kRanges_m[r], error_mm, 1000.0 * testing::rms(spread.sigma_m[r]), mean, pull);
    // Three standard errors of the mean.
    EXPECT_NEAR(mean, 0.0, 3.0 / std::sqrt(static_cast<double>(spread.pull[r].size())))
        << "at " << kRanges_m[r] << " m";
    EXPECT_LE(error_mm, goal_mm[r]) << "at " << kRanges_m[r] << " m";
    EXPECT_NEAR(pull, 1.0, 0.1) << "at " << kRanges_m[r] << " m";
  }
  const double p = testing::ks_p_value(spread.mahalanobis_p);
  std::printf("Mahalanobis distances against chi2(12): KS p = %.3f\n", p);
  EXPECT_GT(p, 0.01);
  const double corner = spread.corner_chi2 / spread.corner_dof;
  const double stripe = spread.stripe_chi2 / spread.stripe_dof;
  std::printf("chi2/dof: corners %.5f +- %.5f, stripe %.5f +- %.5f\n", corner,
              std::sqrt(2.0 / spread.corner_dof), stripe, std::sqrt(2.0 / spread.stripe_dof));
  EXPECT_NEAR(corner, 1.0, 3.0 * std::sqrt(2.0 / spread.corner_dof));
  EXPECT_NEAR(stripe, 1.0, 3.0 * std::sqrt(2.0 / spread.stripe_dof));
}

TEST(CalibrationMonteCarlo, TenVariedBoardsReachTheirRangeErrorAndPredictIt) {
  expect_honest(calibrate_many(400, 10), {1.5, 2.5, 5.0});
}

TEST(CalibrationMonteCarlo, TwentyVariedBoardsReachTheirRangeErrorAndPredictIt) {
  expect_honest(calibrate_many(400, 20), {0.8, 1.3, 2.5});
}

// The same points with their noise turned round.
std::pair<Observations, Observations> with_opposite_noise(Observations truth,
                                                          const SyntheticStriper& striper) {
  std::pair<Observations, Observations> both{truth, truth};
  for (std::size_t v = 0; v < truth.views.size(); ++v)
    for (std::size_t i = 0; i < truth.views[v].pixel.size(); ++i) {
      const Eigen::Vector2d noise(testing::normal(0.0, striper.corner_sigma_px),
                                  testing::normal(0.0, striper.corner_sigma_px));
      both.first.views[v].pixel[i] += noise;
      both.second.views[v].pixel[i] -= noise;
    }
  for (std::size_t s = 0; s < truth.stripes.size(); ++s)
    for (std::size_t i = 0; i < truth.stripes[s].pixel.size(); ++i) {
      const double noise = testing::normal(0.0, striper.stripe_sigma_px);
      for (Observations* o : {&both.first, &both.second})
        o->stripes[s].sigma_px[i] = striper.stripe_sigma_px;
      both.first.stripes[s].pixel[i].y() += noise;
      both.second.stripes[s].pixel[i].y() -= noise;
    }
  return both;
}

// Pulls of the range at 2 m, averaged over noise and its opposite: what is odd in the noise
// cancels, what is left is the bias.
std::vector<double> even_pulls(int sessions, int boards) {
  const SyntheticStriper striper;
  const StriperModel truth = testing::model_of(striper.camera, striper.plane);
  const Eigen::Vector2d pixel = testing::pixel_at_range(truth, 2.0);
  SyntheticStriper noiseless = striper;
  noiseless.corner_sigma_px = noiseless.stripe_sigma_px = 0.0;
  std::vector<double> even;
  for (int i = 0; i < sessions; ++i) {
    const auto [a, b] = with_opposite_noise(testing::varied_boards(noiseless, boards), striper);
    double sum = 0.0;
    for (const Observations& observations : {a, b}) {
      const Triangulator found(testing::model_of(solve_joint(observations, given_sigmas())), 0);
      sum += 0.5 * (found.triangulate(pixel).range_m() - 2.0) / found.sigma_cal_m(pixel);
    }
    even.push_back(sum);
  }
  return even;
}

struct MeanAndError {
  double mean = 0.0;
  double error = 0.0;
};

MeanAndError mean_of(const std::vector<double>& values) {
  MeanAndError result;
  const auto n = static_cast<double>(values.size());
  for (const double v : values) result.mean += v / n;
  for (const double v : values) result.error += (v - result.mean) * (v - result.mean);
  result.error = std::sqrt(result.error / (n * (n - 1.0)));
  return result;
}

// What is left is the second order that every least squares has. (A residual with the pixel's noise
// inside of it, the distance from the plane over its slope, left 0.1 to 0.35 here, and the more the
// denser the stripe.)
TEST(CalibrationMonteCarlo, HasNoBiasToSpeakOf) {
  for (const int boards : {10, 20}) {
    const MeanAndError even = mean_of(even_pulls(25, boards));
    std::printf("%d boards: bias of the range at 2 m %.4f +- %.4f sigma\n", boards, even.mean,
                even.error);
    EXPECT_LT(even.error, 0.01);
    EXPECT_NEAR(even.mean, 0.0, 0.02);
  }
}

TEST(CalibrationMonteCarlo, TwoHalvesOfASessionDifferByWhatTheyPredict) {
  const SyntheticStriper striper;
  const Eigen::MatrixXd S = testing::to_free(striper.camera, striper.plane, kFreeCamera);
  constexpr int kSessions = 200;
  double nees = 0.0;
  for (int i = 0; i < kSessions; ++i) {
    const JointSolution a = solve_joint(testing::varied_boards(striper, 10), given_sigmas());
    const JointSolution b = solve_joint(testing::varied_boards(striper, 10), given_sigmas());
    const Eigen::VectorXd e =
        S * (testing::stacked(a.camera, a.planes[0]) - testing::stacked(b.camera, b.planes[0]));
    const Eigen::MatrixXd C = S * (a.covariance + b.covariance) * S.transpose();
    nees += e.dot(C.ldlt().solve(e)) / kSessions;
  }
  const double half_band = 1.96 * std::sqrt(2.0 * 12.0 / kSessions);
  std::printf("split-half NEES %.2f, 95 %% band 12 +- %.2f\n", nees, half_band);
  EXPECT_NEAR(nees, 12.0, half_band);
}

}  // namespace
}  // namespace striper
