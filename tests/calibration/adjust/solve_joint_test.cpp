// SPDX-License-Identifier: Apache-2.0
// Proves that the joint adjustment returns the truth without noise, that its Jacobians are the
// derivatives, that its covariance is the one Ceres computes, that outliers are taken out, and that
// board sets which leave something undetermined are seen to. The statistics over many calibrations
// are in monte_carlo_test.cpp; images are not involved.
#include <ceres/autodiff_cost_function.h>
#include <ceres/covariance.h>
#include <gtest/gtest.h>

#include "adjust/cost_functions/corner_cost.hpp"
#include "adjust/cost_functions/stripe_cost.hpp"
#include "adjust/joint_problem.hpp"
#include "monte_carlo_support.hpp"

namespace striper {
namespace {

using testing::SyntheticStriper;

double angle_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

TEST(SolveJoint, ReturnsTheTruthWithoutNoise) {
  SyntheticStriper striper;
  striper.corner_sigma_px = 0.0;
  striper.stripe_step = 8;
  Observations observations = testing::empty_observations(striper);
  striper.stripe_sigma_px = 1e-9;
  while (observations.views.size() < 8)
    testing::add_view(
        striper,
        testing::T_cam_board(striper, {testing::uniform(100, 540), testing::uniform(100, 400),
                                       testing::uniform(0.9, 2.6), testing::uniform(-40, 40),
                                       testing::uniform(-40, 40), 5.0}),
        observations);
  for (auto& stripe : observations.stripes)
    std::fill(stripe.sigma_px.begin(), stripe.sigma_px.end(), 0.05);
  JointOptions options;
  options.corner_sigma_px = 0.1;
  options.trust_stripe_sigma = true;
  const JointSolution solution = solve_joint(observations, options);
  EXPECT_NEAR(solution.camera.fx(), striper.camera.fx(), 1e-4);
  EXPECT_NEAR(solution.camera.cy(), striper.camera.cy(), 1e-4);
  EXPECT_LT((solution.camera.parameters() - striper.camera.parameters()).norm(), 1e-3);
  EXPECT_LT(angle_deg(solution.planes.at(0).normal(), striper.plane.normal()), 1e-5);
  EXPECT_NEAR(solution.planes.at(0).distance_m(), 0.5, 1e-7);
  EXPECT_LT(solution.corners.rms_px, 1e-5);
  EXPECT_TRUE(solution.outliers.empty());
}

// Central differences in every parameter of every block.
template <typename Cost, int kResiduals, int kCamera, int... kRest>
void expect_right_jacobian(const Cost& cost, std::vector<std::vector<double>> blocks) {
  const ceres::AutoDiffCostFunction<Cost, kResiduals, kCamera, kRest...> function(new Cost(cost));
  std::vector<const double*> pointers;
  std::vector<std::vector<double>> jacobians;
  std::vector<double*> jacobian_pointers;
  for (const auto& block : blocks) {
    pointers.push_back(block.data());
    jacobians.emplace_back(kResiduals * block.size());
  }
  jacobian_pointers.reserve(jacobians.size());
  for (auto& jacobian : jacobians) jacobian_pointers.push_back(jacobian.data());
  double residual[kResiduals];
  ASSERT_TRUE(function.Evaluate(pointers.data(), residual, jacobian_pointers.data()));
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (std::size_t k = 0; k < blocks[b].size(); ++k) {
      const double value = blocks[b][k];
      const double step = 1e-5 * std::max(std::abs(value), 0.01);
      double above[kResiduals];
      double below[kResiduals];
      blocks[b][k] = value + step;
      ASSERT_TRUE(function.Evaluate(pointers.data(), above, nullptr));
      blocks[b][k] = value - step;
      ASSERT_TRUE(function.Evaluate(pointers.data(), below, nullptr));
      blocks[b][k] = value;
      for (int r = 0; r < kResiduals; ++r) {
        const double expected = (above[r] - below[r]) / (2.0 * step);
        const double found = jacobians[b][static_cast<std::size_t>(r) * blocks[b].size() + k];
        const double rounding = 1e-14 * (std::abs(residual[r]) + 1.0) / step;
        EXPECT_NEAR(found, expected, 1e-6 * std::abs(expected) + rounding)
            << "block " << b << ", parameter " << k << ", residual " << r;
      }
    }
}

TEST(CostFunctions, HaveTheDerivativesOfTheirValues) {
  const SyntheticStriper striper;
  const auto T = testing::T_cam_board(striper, {470, 370, 1.5, 25, -20, 10});
  const auto pose = detail::to_block(T);
  const std::vector<double> pose_block(pose.begin(), pose.end());
  const auto w = detail::to_block(striper.plane);
  const std::vector<double> plane_block(w.begin(), w.end());
  const std::vector<double> bend = {0.002, -0.001};
  const detail::BendShape shape(striper.board);
  const std::vector<double> nine = {610, 620, 318, 242, -0.25, 0.1, 1e-3, -2e-3, 0.02};
  const std::vector<double> twelve = {610,  620,   318,  242,  -0.2, 0.1,
                                      1e-3, -2e-3, 0.02, 0.03, 0.01, -0.02};
  const std::vector<double> eight = {610, 620, 318, 242, -0.02, 0.01, 1e-3, -2e-3};
  const detail::CornerCost corner{LensModel::kPlumbBob, shape,      {0.002, -0.001},
                                  {0.12, 0.18},         {300, 200}, 0.1};
  expect_right_jacobian<detail::CornerCost, 2, 9, 6, 2>(corner, {nine, pose_block, bend});
  expect_right_jacobian<detail::CornerCost, 2, 9, 6>(corner, {nine, pose_block});
  detail::CornerCost dot = corner;
  dot.dot_radius_m = 0.02;
  expect_right_jacobian<detail::CornerCost, 2, 9, 6, 2>(dot, {nine, pose_block, bend});
  expect_right_jacobian<detail::CornerCost, 2, 9, 6>(dot, {nine, pose_block});
  detail::CornerCost other = corner;
  other.lens = LensModel::kRationalPolynomial;
  expect_right_jacobian<detail::CornerCost, 2, 12, 6, 2>(other, {twelve, pose_block, bend});
  other.lens = LensModel::kEquidistant;
  expect_right_jacobian<detail::CornerCost, 2, 8, 6, 2>(other, {eight, pose_block, bend});
  const Eigen::Vector2d start(0.2, 0.2);
  const auto stripe = [&](LensModel lens, int count, StripeAxis axis) {
    return detail::StripeCost{{lens, count, shape, axis, 500.0, start}, {0.0, 0.0}, 390.0, 0.05};
  };
  expect_right_jacobian<detail::StripeCost, 1, 9, 6, 2, 3>(
      stripe(LensModel::kPlumbBob, 9, StripeAxis::kColumns), {nine, pose_block, bend, plane_block});
  expect_right_jacobian<detail::StripeCost, 1, 9, 6, 3>(
      stripe(LensModel::kPlumbBob, 9, StripeAxis::kColumns), {nine, pose_block, plane_block});
  expect_right_jacobian<detail::StripeCost, 1, 12, 6, 2, 3>(
      stripe(LensModel::kRationalPolynomial, 12, StripeAxis::kColumns),
      {twelve, pose_block, bend, plane_block});
  expect_right_jacobian<detail::StripeCost, 1, 8, 6, 2, 3>(
      stripe(LensModel::kEquidistant, 8, StripeAxis::kColumns),
      {eight, pose_block, bend, plane_block});
  // A laser plane that stands upright, seen along rows.
  const auto upright =
      detail::to_block(LaserPlane(Eigen::Vector3d(0.9, -0.14, 0.4).normalized(), 0.7));
  expect_right_jacobian<detail::StripeCost, 1, 9, 6, 2, 3>(
      stripe(LensModel::kPlumbBob, 9, StripeAxis::kRows),
      {nine, pose_block, bend, std::vector<double>(upright.begin(), upright.end())});
}

// The plain way: where does the line in which the two planes meet, in space, cross the column?
TEST(StripeCrossing, IsWhereTheLineOfBothPlanesProjectsTo) {
  const SyntheticStriper striper;
  const detail::BendShape shape(striper.board);
  const Eigen::VectorXd camera = striper.camera.parameters();
  const auto plane = detail::to_block(striper.plane);
  for (const testing::BoardPose& attitude :
       {testing::BoardPose{320, 300, 1.2, 25, 20, 5}, {300, 280, 1.5, -30, -15, -8}}) {
    const auto T = testing::T_cam_board(striper, attitude);
    const auto pose = detail::to_block(T);
    const std::vector<Eigen::Vector2d> truth = testing::stripe_on_board(striper, T);
    ASSERT_GT(truth.size(), 100U);
    for (const Eigen::Vector2d& pixel : truth) {
      const detail::StripeCrossing crossing{LensModel::kPlumbBob, 9,         shape,
                                            StripeAxis::kColumns, pixel.x(), {0.0, 0.2}};
      double v_px = 0.0;
      ASSERT_TRUE(crossing(camera.data(), pose.data(), static_cast<const double*>(nullptr),
                           plane.data(), v_px));
      EXPECT_NEAR(v_px, pixel.y(), 1e-6);
    }
  }
}

TEST(SolveJoint, CovarianceIsThatOfTheWholeNormalMatrix) {
  SyntheticStriper striper;
  striper.stripe_step = 16;
  const Observations observations = testing::varied_boards(striper, 6);
  JointOptions options;
  options.corner_sigma_px = 0.1;
  options.trust_stripe_sigma = true;
  const JointSolution solution = solve_joint(observations, options);

  detail::JointState state;
  state.camera = solution.camera;
  const Eigen::VectorXd parameters = solution.camera.parameters();
  state.parameters.assign(parameters.data(), parameters.data() + parameters.size());
  for (const auto& T : solution.T_cam_board) state.poses.push_back(detail::to_block(T));
  state.planes.push_back(detail::to_block(solution.planes[0]));
  detail::JointWeights weights;
  weights.corner_sigma_px = 0.1;
  for (const auto& view : observations.views)
    weights.corner_used.emplace_back(view.pixel.size(), 1);
  for (const auto& stripe : observations.stripes)
    weights.stripe_used.emplace_back(stripe.pixel.size(), 1);
  for (const auto& outlier : solution.outliers)
    (outlier.is_stripe ? weights.stripe_used : weights.corner_used)[static_cast<std::size_t>(
        outlier.view)][static_cast<std::size_t>(outlier.index)] = 0;
  const auto problem = detail::make_problem(observations, options, weights, 0.0, state);
  ceres::Covariance::Options ceres_options;
  ceres_options.algorithm_type = ceres::SPARSE_QR;
  ceres::Covariance covariance(ceres_options);
  const std::vector<std::pair<const double*, const double*>> blocks = {
      {state.parameters.data(), state.parameters.data()}};
  ASSERT_TRUE(covariance.Compute(blocks, problem.get()));
  Eigen::Matrix<double, 9, 9, Eigen::RowMajor> expected;
  covariance.GetCovarianceBlock(state.parameters.data(), state.parameters.data(), expected.data());
  const Eigen::MatrixXd found = solution.covariance.topLeftCorner(9, 9);
  EXPECT_LT((found - expected).norm(), 1e-4 * expected.norm());

  const Eigen::Matrix4d plane_block = solution.covariance.bottomRightCorner<4, 4>();
  const Eigen::Vector4d normal_direction(solution.planes[0].normal().x(),
                                         solution.planes[0].normal().y(),
                                         solution.planes[0].normal().z(), 0.0);
  EXPECT_LT((plane_block * normal_direction).norm(), 1e-9 * plane_block.norm())
      << "a plane has three degrees of freedom";
}

TEST(SolveJoint, TakesOutWrongCornersAndAGlareOnTheStripe) {
  SyntheticStriper striper;
  striper.stripe_step = 4;
  Observations observations = testing::varied_boards(striper, 8);
  observations.views[2].pixel[10] += Eigen::Vector2d(3.0, -2.0);
  for (int i = 0; i < 10; ++i)
    observations.stripes[3].pixel[static_cast<std::size_t>(i)].y() -= 4.0;
  JointOptions options;
  const JointSolution solution = solve_joint(observations, options);
  EXPECT_TRUE(std::any_of(solution.outliers.begin(), solution.outliers.end(), [](const auto& o) {
    return !o.is_stripe && o.view == 2 && o.index == 10;
  }));
  EXPECT_EQ(10, std::count_if(solution.outliers.begin(), solution.outliers.end(),
                              [](const auto& o) { return o.is_stripe && o.view == 3; }));
  EXPECT_NEAR(solution.corners.sigma_px, 0.1, 0.01);
  EXPECT_NEAR(solution.stripes.sigma_px, 0.05, 0.005);
  EXPECT_LT(angle_deg(solution.planes[0].normal(), striper.plane.normal()), 0.2);
}

TEST(SolveJoint, FindsTheBendOfABoard) {
  SyntheticStriper striper;
  striper.bend_m = {0.004, -0.002};
  Observations observations = testing::varied_boards(striper, 15);
  observations.stripes.clear();
  JointOptions options;
  options.solve_bend = true;
  const JointSolution solution = solve_joint(observations, options);
  EXPECT_NEAR(solution.bend_m.x(), 0.004, 4.0 * std::sqrt(solution.bend_covariance(0, 0)));
  EXPECT_NEAR(solution.bend_m.y(), -0.002, 4.0 * std::sqrt(solution.bend_covariance(1, 1)));
  EXPECT_LT(std::sqrt(solution.bend_covariance(0, 0)), 0.0005);
}

TEST(SolveJoint, HoldsACameraThatIsGivenWithoutCovariance) {
  SyntheticStriper striper;
  striper.stripe_step = 8;
  const Observations observations = testing::varied_boards(striper, 4);
  JointOptions options;
  options.known_camera = KnownCamera{striper.camera, std::nullopt};
  const JointSolution solution = solve_joint(observations, options);
  EXPECT_EQ(solution.camera, striper.camera);
  EXPECT_LT(angle_deg(solution.planes[0].normal(), striper.plane.normal()), 0.1);
  EXPECT_EQ(0.0, solution.covariance.topLeftCorner(9, 9).norm());
  EXPECT_GT(solution.covariance.bottomRightCorner(4, 4).norm(), 0.0);
}

// The derivative of the planes by the camera is that of solutions with other cameras, and the rest
// of the covariance is that of a camera without error.
TEST(SolveJoint, AddsTheErrorOfACameraThatItHolds) {
  SyntheticStriper striper;
  striper.stripe_step = 8;
  const Observations observations = testing::varied_boards(striper, 6);
  Eigen::VectorXd sigma(9);
  sigma << 0.5, 0.5, 0.5, 0.5, 0.002, 0.005, 1e-4, 1e-4, 0.005;
  JointOptions options;
  options.corner_sigma_px = 0.1;
  options.trust_stripe_sigma = true;
  options.remove_outliers = false;
  const auto solve = [&](const CameraModel& camera, bool with_error) {
    options.known_camera = KnownCamera{camera, std::nullopt};
    if (with_error)
      options.known_camera->covariance = Eigen::MatrixXd(sigma.cwiseAbs2().asDiagonal());
    return solve_joint(observations, options);
  };
  const JointSolution solution = solve(striper.camera, true);
  EXPECT_EQ(solution.camera, striper.camera);
  const Eigen::MatrixXd plane_by_camera =
      solution.covariance.bottomLeftCorner(4, 9) * sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  const auto plane_of = [&](const Eigen::VectorXd& parameters) {
    const LaserPlane plane = solve(striper.camera.with_parameters(parameters), false).planes[0];
    return Eigen::Vector4d(plane.normal().x(), plane.normal().y(), plane.normal().z(),
                           plane.distance_m());
  };
  for (int i = 0; i < 9; ++i) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(9);
    step[i] = 0.1 * sigma[i];
    const Eigen::VectorXd at = striper.camera.parameters();
    const Eigen::Vector4d change = plane_of(at + step) - plane_of(at - step);
    const Eigen::Vector4d derivative = change / (0.2 * sigma[i]);
    EXPECT_LT((derivative - plane_by_camera.col(i)).norm(), 0.03 * derivative.norm() + 1e-7)
        << "parameter " << i << ": " << derivative.transpose() << " and "
        << plane_by_camera.col(i).transpose();
  }
  const Eigen::MatrixXd own = solution.covariance - solution.from_known_camera;
  EXPECT_LT((own - solve(striper.camera, false).covariance).norm(), 1e-6 * own.norm());
}

TEST(SolveJoint, SeesThatFrontoParallelBoardsLeaveTheFocalLengthFree) {
  SyntheticStriper striper;
  striper.stripe_step = 8;
  const Observations observations = testing::boards_tilted(striper, 10, 0.0, 0.0);
  JointOptions options;
  options.corner_sigma_px = 0.1;
  options.trust_stripe_sigma = true;
  const JointSolution solution = solve_joint(observations, options);
  if (solution.covariance.size() > 0) {
    EXPECT_GT(std::sqrt(solution.covariance(0, 0)), 0.05 * striper.camera.fx());
  }
  EXPECT_LT(solution.rcond, 1e-6);
}

}  // namespace
}  // namespace striper
