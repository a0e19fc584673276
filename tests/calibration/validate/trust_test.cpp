// SPDX-License-Identifier: Apache-2.0
// Proves that sets of images that cannot determine the model are refused with the missing
// direction named, that good ones are not, that the split-half test passes where the model is right
// and fails where it is not, and, over a few dozen calibrations, that the covariance is honest (the
// hundreds are in monte_carlo_test.cpp).
#include <glog/logging.h>
#include <gmock/gmock.h>

#include <striper/core/statistics.hpp>
#include <striper/validate/cross_validation.hpp>
#include <striper/validate/trust.hpp>

#include "../adjust/monte_carlo_support.hpp"

namespace striper {
namespace {

using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::SyntheticStriper;

JointOptions given_sigmas() {
  JointOptions options;
  options.corner_sigma_px = 0.1;
  options.trust_stripe_sigma = true;
  return options;
}

std::vector<Event> findings_of(const Observations& observations, const JointSolution& solution,
                               const JointOptions& options = given_sigmas()) {
  StriperModel model = testing::model_of(solution.camera, solution.planes.at(0));
  if (solution.covariance.size() > 0)
    model.covariance = ModelCovariance{covariance_names(solution.camera, 1), solution.covariance};
  return check_trust(observations, solution, options, model);
}

std::vector<Event> findings_of(const Observations& observations,
                               const JointOptions& options = given_sigmas()) {
  return findings_of(observations, solve_joint(observations, options), options);
}

auto refusal(EventCode code) {
  return Contains(
      ::testing::AllOf(Field(&Event::code, code), Field(&Event::severity, Severity::kRefusal)));
}

SyntheticStriper thinned() {
  SyntheticStriper striper;
  striper.stripe_step = 8;
  return striper;
}

TEST(CheckTrust, AcceptsTenVariedBoards) {
  const auto findings = findings_of(testing::varied_boards(thinned(), 10));
  EXPECT_LT(worst(findings), Severity::kRefusal) << findings.front().message;
}

TEST(CheckTrust, RefusesFrontoParallelBoards) {
  const auto findings = findings_of(testing::boards_tilted(thinned(), 10, 0.0, 0.0));
  EXPECT_THAT(findings, refusal("boards_parallel"));
  for (const Event& finding : findings)
    if (finding.code == "boards_parallel") {
      EXPECT_THAT(finding.advice, HasSubstr("turned by 30 to 45 degrees"));
    }
}

TEST(CheckTrust, RefusesParallelTiltedBoards) {
  EXPECT_THAT(findings_of(testing::boards_tilted(thinned(), 10, 30.0, 0.0)),
              refusal("boards_parallel"));
}

TEST(CheckTrust, RefusesTiltsWithinFiveDegrees) {
  EXPECT_THAT(findings_of(testing::boards_tilted(thinned(), 10, 0.0, 5.0)),
              refusal("boards_parallel"));
}

TEST(CheckTrust, RefusesCoincidentBoards) {
  const SyntheticStriper striper = thinned();
  Observations observations = testing::empty_observations(striper);
  // One plane, the board only slid and turned within it.
  const auto T = testing::T_cam_board(striper, {320, 240, 1.5, 20, 10, 0});
  while (observations.views.size() < 10)
    testing::add_view(
        striper,
        T * Eigen::Translation3d(testing::uniform(-0.2, 0.2), testing::uniform(-0.1, 0.1), 0.0) *
            Eigen::AngleAxisd(testing::uniform(-0.3, 0.3), Eigen::Vector3d::UnitZ()),
        observations);
  const auto findings = findings_of(observations);
  EXPECT_THAT(findings, refusal("boards_parallel"));
  EXPECT_THAT(findings, refusal("planes_coincident"));
}

// Two boards that are nearly parallel: the adjustment of the laser's plane runs away, and what is
// left of its information once the poses are eliminated is rounding, of either sign.
TEST(CheckTrust, SaysWhichDirectionIsFreeWhereNothingIsLeftOfItsInformation) {
  const SyntheticStriper striper = thinned();
  Observations observations = testing::empty_observations(striper);
  for (const double tilt_deg : {60.0, 62.0})
    testing::add_view(striper, testing::T_cam_board(striper, {320, 240, 1.5, tilt_deg, 10, 0}),
                      observations);
  const auto findings = findings_of(observations);
  EXPECT_THAT(findings, Contains(::testing::AllOf(
                            Field(&Event::code, EventCode("singular")),
                            Field(&Event::message, HasSubstr("mostly laser0_")),
                            Field(&Event::message, HasSubstr("reciprocal condition 0)")))));
  for (const Event& finding : findings) EXPECT_THAT(finding.message, Not(HasSubstr("nan")));
}

TEST(CheckTrust, RefusesCoincidentStripesWithAKnownCamera) {
  const SyntheticStriper striper = thinned();
  Observations observations = testing::empty_observations(striper);
  const auto T = testing::T_cam_board(striper, {320, 240, 1.5, 20, 10, 0});
  while (observations.views.size() < 6)
    testing::add_view(
        striper,
        T * Eigen::Translation3d(testing::uniform(-0.2, 0.2), testing::uniform(-0.1, 0.1), 0.0),
        observations);
  JointOptions options = given_sigmas();
  options.known_camera = KnownCamera{striper.camera, std::nullopt};
  EXPECT_THAT(findings_of(observations, options), refusal("planes_coincident"));
}

TEST(CheckTrust, AcceptsOneDepthWithVariedTilt) {
  const SyntheticStriper striper = thinned();
  Observations observations = testing::empty_observations(striper);
  while (observations.views.size() < 12)
    testing::add_view(
        striper,
        testing::T_cam_board(striper, {testing::uniform(150, 490), testing::uniform(150, 380), 1.5,
                                       testing::uniform(-40, 40), testing::uniform(-40, 40),
                                       testing::uniform(-15, 15)}),
        observations);
  const auto findings = findings_of(observations);
  EXPECT_LT(worst(findings), Severity::kRefusal) << findings.front().message;
}

TEST(CheckTrust, RefusesAStripeInACornerOfTheImage) {
  const SyntheticStriper striper = thinned();
  Observations observations = testing::varied_boards(striper, 20);
  std::vector<double> rows;
  for (const StripeView& stripe : observations.stripes)
    for (const auto& pixel : stripe.pixel) rows.push_back(pixel.y());
  std::nth_element(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(rows.size() / 2),
                   rows.end());
  const double row = rows[rows.size() / 2];
  for (StripeView& stripe : observations.stripes) {
    const StripeView all = stripe;
    stripe.pixel.clear();
    stripe.sigma_px.clear();
    for (std::size_t i = 0; i < all.pixel.size(); ++i) {
      if (all.pixel[i].x() > 300.0 || all.pixel[i].x() < 180.0) continue;
      if (std::abs(all.pixel[i].y() - row) > 40.0) continue;
      stripe.pixel.push_back(all.pixel[i]);
      stripe.sigma_px.push_back(all.sigma_px[i]);
    }
  }
  std::erase_if(observations.stripes, [](const StripeView& s) { return s.pixel.size() < 3; });
  if (observations.stripes.size() < 2) GTEST_FAIL() << "the set has no stripe in that corner";
  EXPECT_GE(worst(findings_of(observations)), Severity::kWarning);
  EXPECT_THAT(findings_of(observations), refusal("stripe_in_corner"));
}

TEST(CheckTrust, RefusesTwoImages) {
  EXPECT_THAT(findings_of(testing::varied_boards(thinned(), 2)), refusal("too_few_views"));
}

TEST(CheckTrust, RefusesStripesThatLieInNoPlane) {
  const Observations observations = testing::varied_boards(thinned(), 10);
  JointSolution solution = solve_joint(observations, given_sigmas());
  solution.stripes.rms_px = 2.9;
  EXPECT_THAT(findings_of(observations, solution), Not(refusal("stripes_do_not_fit")));
  solution.stripes.rms_px = 16.0;
  EXPECT_THAT(findings_of(observations, solution), refusal("stripes_do_not_fit"));
}

TEST(CheckTrust, WarnsOfAnUnlikelySquare) {
  SyntheticStriper striper = thinned();
  Observations observations = testing::varied_boards(striper, 8);
  observations.board.square_m = 6.0;  // Centimetres, given as metres.
  const auto findings = findings_of(observations);
  EXPECT_THAT(findings, Contains(Field(&Event::code, EventCode("scale_unlikely"))));
}

TEST(CrossValidate, PassesWhereTheModelIsRight) {
  const SyntheticStriper striper = thinned();
  double nees = 0.0;
  constexpr int kSessions = 8;
  for (int i = 0; i < kSessions; ++i) {
    const Observations observations = testing::varied_boards(striper, 12);
    const JointSolution solution = solve_joint(observations, JointOptions{});
    const CrossValidation validation = cross_validate(observations, solution, JointOptions{}, 2);
    EXPECT_EQ(12.0, validation.dof);
    EXPECT_GT(validation.splits, 4);
    EXPECT_NEAR(validation.corner_rms_px(), 0.1 * std::sqrt(2.0), 0.03);
    // The held-out pose comes from its corners alone, so that it adds to the stripe's 0.05 px.
    EXPECT_GT(validation.stripe_rms_px(), 0.05);
    EXPECT_LT(validation.stripe_rms_px(), 0.16);
    nees += validation.nees / kSessions;
  }
  // Mean of 8 sessions: 12 +- sqrt(2 * 12 / 8); halves of six boards are a little beyond linear.
  EXPECT_NEAR(nees, 12.0, 4.0 * std::sqrt(24.0 / kSessions));
}

TEST(CrossValidate, LeavesTheLevelOfTheSolversLogAsItWas) {
  const SyntheticStriper striper = thinned();
  const Observations observations = testing::varied_boards(striper, 12);
  const JointSolution solution = solve_joint(observations, JointOptions{});
  const int before = FLAGS_minloglevel;
  for (int i = 0; i < 3; ++i) {
    static_cast<void>(cross_validate(observations, solution, JointOptions{}, 4));
    EXPECT_EQ(before, FLAGS_minloglevel);
  }
}

TEST(CrossValidate, FailsWhereTheLensIsNotTheModels) {
  SyntheticStriper striper = thinned();
  striper.corner_sigma_px = 0.02;
  striper.stripe_sigma_px = 0.02;
  striper.camera = striper.camera.with_parameters(
      (Eigen::VectorXd(9) << 400.0, 400.0, 319.5, 239.5, -0.3, 0.12, 0.0, 0.0, -0.02).finished());
  const Observations observations = testing::varied_boards(striper, 16);
  JointOptions options;
  options.hold_k3 = true;
  const JointSolution solution = solve_joint(observations, options);
  const CrossValidation validation = cross_validate(observations, solution, options, 2);
  EXPECT_GT(validation.nees, validation.nees_high);
  EXPECT_GT(validation.covariance_factor, 1.0);
}

TEST(Calibration, IsAsGoodAsItSaysOverForty) {
  const SyntheticStriper striper = thinned();
  const StriperModel truth = testing::model_of(striper.camera, striper.plane);
  std::vector<double> pulls;
  std::vector<double> errors_m;
  for (int i = 0; i < 40; ++i) {
    const JointSolution solution = solve_joint(testing::varied_boards(striper, 8), given_sigmas());
    const Triangulator found(testing::model_of(solution), 0);
    const Eigen::Vector2d pixel = testing::pixel_at_range(truth, 2.0);
    errors_m.push_back(found.triangulate(pixel).range_m() - 2.0);
    pulls.push_back(errors_m.back() / found.sigma_cal_m(pixel));
  }
  // 3 sigma of the rms of 40 values.
  EXPECT_NEAR(testing::rms(pulls), 1.0, 3.0 / std::sqrt(80.0));
  EXPECT_LT(testing::rms(errors_m), 0.005);
}

TEST(Chi2Quantile, AgreesWithTheDistribution) {
  for (const double dof : {3.0, 9.0, 12.0, 40.0})
    for (const double p : {0.025, 0.5, 0.975, 0.995})
      EXPECT_NEAR(testing::chi2_cdf(chi2_quantile(p, dof), dof), p, 0.006) << dof;
}

}  // namespace
}  // namespace striper
