// SPDX-License-Identifier: Apache-2.0
#include "adjust/joint_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>
#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>

#include "adjust/cost_functions/corner_cost.hpp"
#include "adjust/cost_functions/stripe_cost.hpp"
#include "adjust/cost_functions/stripe_skew.hpp"

namespace striper::detail {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <typename Cost, int kResiduals, int... kRest>
ceres::CostFunction* autodiff(Cost cost, std::size_t camera_count) {
  switch (camera_count) {
    case 8:
      return new ceres::AutoDiffCostFunction<Cost, kResiduals, 8, kRest...>(
          new Cost(std::move(cost)));
    case 9:
      return new ceres::AutoDiffCostFunction<Cost, kResiduals, 9, kRest...>(
          new Cost(std::move(cost)));
    default:
      return new ceres::AutoDiffCostFunction<Cost, kResiduals, 12, kRest...>(
          new Cost(std::move(cost)));
  }
}

// Made with the first residual that wants it: the problem then owns it.
class SharedLoss {
 public:
  explicit SharedLoss(double sigmas) : sigmas_(sigmas) {}
  ceres::LossFunction* get() {
    if (loss_ == nullptr && sigmas_ > 0.0) loss_ = new ceres::HuberLoss(sigmas_);
    return loss_;
  }

 private:
  double sigmas_;
  ceres::LossFunction* loss_ = nullptr;
};

CornerCost corner_cost(const JointState& state, const Board& board, int point,
                       const Eigen::Vector2d& pixel, double sigma_px) {
  return {state.camera.lens(), BendShape(board), state.bend, board.point_m(point), pixel, sigma_px,
          board.dot_radius_m()};
}

void add_corners(const Observations& observations, const JointWeights& weights, double loss_sigmas,
                 bool solve_bend, JointState& state, ceres::Problem& problem) {
  SharedLoss loss(loss_sigmas);
  double* const camera = state.parameters.data();
  const std::size_t count = state.parameters.size();
  for (std::size_t v = 0; v < observations.views.size(); ++v) {
    const CornerView& view = observations.views[v];
    double* const pose = state.poses[v].data();
    for (std::size_t i = 0; i < view.pixel.size(); ++i) {
      if (!weights.corner_used[v][i]) continue;
      const CornerCost cost = corner_cost(state, observations.board, view.point[i], view.pixel[i],
                                          weights.corner_sigma_px);
      if (solve_bend)
        problem.AddResidualBlock(autodiff<CornerCost, 2, 6, 2>(cost, count), loss.get(), camera,
                                 pose, state.bend.data());
      else
        problem.AddResidualBlock(autodiff<CornerCost, 2, 6>(cost, count), loss.get(), camera, pose);
    }
  }
}

StripeCrossing crossing_of(const JointState& state, const BendShape& shape, StripeAxis axis,
                           const Eigen::Vector2d& pixel, const Eigen::Vector2d& start) {
  return {state.camera.lens(),
          static_cast<int>(state.parameters.size()),
          shape,
          axis,
          axis == StripeAxis::kColumns ? pixel.x() : pixel.y(),
          start};
}

double across(StripeAxis axis, const Eigen::Vector2d& pixel) {
  return axis == StripeAxis::kColumns ? pixel.y() : pixel.x();
}

// The ray of a pixel, from that of one nearby.
Eigen::Vector2d ray_near(const JointState& state, Eigen::Vector2d xy,
                         const Eigen::Vector2d& pixel) {
  using Jet = ceres::Jet<double, 2>;
  std::array<Jet, 12> camera;
  for (std::size_t i = 0; i < state.parameters.size(); ++i) camera[i] = Jet(state.parameters[i]);
  for (int pass = 0; pass < 3; ++pass) {
    const auto q = project_normalized<Jet>(state.camera.lens(), camera.data(),
                                           {Jet(xy.x(), 0), Jet(xy.y(), 1)});
    Eigen::Matrix2d J;
    J.row(0) = q.x().v.transpose();
    J.row(1) = q.y().v.transpose();
    xy -= J.inverse() * (Eigen::Vector2d(q.x().a, q.y().a) - pixel);
  }
  return xy;
}

// How the board slopes along the scan line about the middle of the laser plane. The laser is taken
// to be where the scan frame begins, below the camera: the plane does not say where in it the laser
// is.
ProfileSlopes slopes_at(const JointState& state, const BendShape& shape, StripeAxis axis,
                        const PoseBlock& pose, const std::array<double, 3>& plane,
                        const Eigen::Vector2d& ray) {
  const double* const camera = state.parameters.data();
  const Eigen::Vector3d w = Eigen::Map<const Eigen::Vector3d>(plane.data());
  const Eigen::Vector3d laser = w / w.squaredNorm();
  const Eigen::Vector2d middle = project_normalized<double>(state.camera.lens(), camera, ray);
  const Eigen::Vector2d step = axis == StripeAxis::kColumns ? Eigen::Vector2d::UnitY().eval()
                                                            : Eigen::Vector2d::UnitX().eval();
  const auto point = [&](double away_px) {
    return point_on_board<double>(ray_near(state, ray, middle + away_px * step), pose.data(),
                                  state.bend.data(), shape);
  };
  const Eigen::Vector3d before = point(-1.0);
  const Eigen::Vector3d here = point(0.0);
  const Eigen::Vector3d after = point(1.0);
  ProfileSlopes slopes;
  slopes.rise = w.dot(after - 2.0 * here + before) / w.dot(after - before);
  slopes.distance = 0.5 * std::log((after - laser).norm() / (before - laser).norm());
  return slopes;
}

void add_stripes(const Observations& observations, const JointWeights& weights, double loss_sigmas,
                 bool solve_bend, JointState& state, ceres::Problem& problem) {
  SharedLoss loss(loss_sigmas);
  const BendShape shape(observations.board);
  const StripeAxis axis = observations.axis;
  double* const camera = state.parameters.data();
  const std::size_t count = state.parameters.size();
  for (std::size_t s = 0; s < observations.stripes.size(); ++s) {
    const StripeView& stripe = observations.stripes[s];
    PoseBlock& pose = state.poses[static_cast<std::size_t>(stripe.view)];
    auto& plane = state.planes[static_cast<std::size_t>(stripe.laser)];
    for (std::size_t i = 0; i < stripe.pixel.size(); ++i) {
      if (!weights.stripe_used[s][i]) continue;
      const auto at = stripe_residual(state, observations.board, axis, pose, stripe, i);
      if (!at) continue;
      // The skew is so small that it may stay while the state moves.
      const StripeCost cost{crossing_of(state, shape, axis, stripe.pixel[i], at->ray), state.bend,
                            across(axis, stripe.pixel[i]) - at->skew_px,
                            stripe.sigma_px[i] * weights.stripe_factor};
      if (solve_bend)
        problem.AddResidualBlock(autodiff<StripeCost, 1, 6, 2, 3>(cost, count), loss.get(), camera,
                                 pose.data(), state.bend.data(), plane.data());
      else
        problem.AddResidualBlock(autodiff<StripeCost, 1, 6, 3>(cost, count), loss.get(), camera,
                                 pose.data(), plane.data());
    }
  }
}

// A given camera is held whether its error is known or not: boards that are not flat would move it
// by many times that error, and the planes with it. What its error does to the result is added to
// the covariance (add_known_camera).
void constrain_camera(const JointOptions& options, JointState& state, ceres::Problem& problem) {
  double* const camera = state.parameters.data();
  const auto count = static_cast<int>(state.parameters.size());
  if (options.known_camera)
    problem.SetParameterBlockConstant(camera);
  else if (options.hold_k3 && options.lens == LensModel::kPlumbBob)
    problem.SetManifold(camera, new ceres::SubsetManifold(count, {count - 1}));
}

}  // namespace

void JointState::set_camera(const CameraModel& start) {
  camera = start;
  const Eigen::VectorXd numbers = start.parameters();
  parameters.assign(numbers.data(), numbers.data() + numbers.size());
}

CameraModel JointState::camera_now() const {
  return camera.with_parameters(Eigen::Map<const Eigen::VectorXd>(
      parameters.data(), static_cast<Eigen::Index>(parameters.size())));
}

std::array<double, 3> to_block(const LaserPlane& plane) {
  const Eigen::Vector3d w = plane.normal() / plane.distance_m();
  return {w.x(), w.y(), w.z()};
}

LaserPlane to_plane(const std::array<double, 3>& block) {
  const Eigen::Vector3d w(block[0], block[1], block[2]);
  return {w.normalized(), 1.0 / w.norm()};
}

std::unique_ptr<ceres::Problem> make_problem(const Observations& observations,
                                             const JointOptions& options,
                                             const JointWeights& weights, double loss_sigmas,
                                             JointState& state) {
  auto problem = std::make_unique<ceres::Problem>();
  problem->AddParameterBlock(state.parameters.data(), static_cast<int>(state.parameters.size()));
  problem->AddParameterBlock(state.bend.data(), 2);
  for (PoseBlock& pose : state.poses) problem->AddParameterBlock(pose.data(), 6);
  for (auto& plane : state.planes) problem->AddParameterBlock(plane.data(), 3);
  add_corners(observations, weights, loss_sigmas, options.solve_bend, state, *problem);
  add_stripes(observations, weights, loss_sigmas, options.solve_bend, state, *problem);
  constrain_camera(options, state, *problem);
  if (!options.solve_bend) problem->SetParameterBlockConstant(state.bend.data());
  return problem;
}

std::optional<StripeResidual> stripe_residual(const JointState& state, const Board& board,
                                              StripeAxis axis, const PoseBlock& pose,
                                              const StripeView& stripe, std::size_t point) {
  const double* const camera = state.parameters.data();
  const double* const bend =
      state.bend[0] == 0.0 && state.bend[1] == 0.0 ? nullptr : state.bend.data();
  const Eigen::Vector2d& pixel = stripe.pixel[point];
  const auto& plane = state.planes[static_cast<std::size_t>(stripe.laser)];
  const BendShape shape(board);
  const Eigen::Vector2d pinhole((pixel.x() - camera[2]) / camera[0],
                                (pixel.y() - camera[3]) / camera[1]);
  StripeCrossing crossing = crossing_of(state, shape, axis, pixel, pinhole);
  const auto ray = crossing.ray(camera, pose.data(), bend, plane.data());
  if (!ray) return std::nullopt;
  crossing.start = *ray;
  double predicted_px = 0.0;
  crossing(camera, pose.data(), bend, plane.data(), predicted_px);
  const double skew_px = stripe.thickness_px > 0.0
                             ? stripe_skew_px(slopes_at(state, shape, axis, pose, plane, *ray),
                                              stripe.thickness_px, stripe.width_px)
                             : 0.0;
  return StripeResidual{across(axis, pixel) - predicted_px - skew_px, skew_px, *ray};
}

Eigen::Vector2d corner_residual(const JointState& state, const Board& board, const PoseBlock& pose,
                                int point, const Eigen::Vector2d& pixel) {
  const CornerCost cost = corner_cost(state, board, point, pixel, 1.0);
  Eigen::Vector2d residual;
  if (!cost(state.parameters.data(), pose.data(), residual.data())) return {kNan, kNan};
  return residual;
}

}  // namespace striper::detail
