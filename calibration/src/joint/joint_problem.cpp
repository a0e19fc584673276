// SPDX-License-Identifier: Apache-2.0
#include "joint/joint_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <ceres/autodiff_cost_function.h>
#include <ceres/crs_matrix.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/normal_prior.h>

#include "cost_functions/corner_cost.hpp"
#include "cost_functions/stripe_cost.hpp"

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

void add_corners(const Observations& observations, const JointWeights& weights, double loss_sigmas,
                 JointState& state, ceres::Problem& problem) {
  ceres::LossFunction* loss = nullptr;  // Made with the first residual: the problem then owns it.
  const auto shared_loss = [&] {
    if (loss == nullptr && loss_sigmas > 0.0) loss = new ceres::HuberLoss(loss_sigmas);
    return loss;
  };
  const BendShape shape(observations.board);
  const LensModel lens = state.camera.lens();
  for (std::size_t v = 0; v < observations.views.size(); ++v) {
    const CornerView& view = observations.views[v];
    for (std::size_t i = 0; i < view.pixel.size(); ++i) {
      if (!weights.corner_used[v][i]) continue;
      CornerCost cost{lens, shape, observations.board.point_m(view.point[i]), view.pixel[i],
                      weights.corner_sigma_px};
      problem.AddResidualBlock(autodiff<CornerCost, 2, 6, 2>(cost, state.parameters.size()),
                               shared_loss(), state.parameters.data(), state.poses[v].data(),
                               state.bend.data());
    }
  }
}

void add_stripes(const Observations& observations, const JointWeights& weights, double loss_sigmas,
                 JointState& state, ceres::Problem& problem) {
  ceres::LossFunction* loss = nullptr;  // Made with the first residual: the problem then owns it.
  const auto shared_loss = [&] {
    if (loss == nullptr && loss_sigmas > 0.0) loss = new ceres::HuberLoss(loss_sigmas);
    return loss;
  };
  const BendShape shape(observations.board);
  const int count = static_cast<int>(state.parameters.size());
  for (std::size_t s = 0; s < observations.stripes.size(); ++s) {
    const StripeView& stripe = observations.stripes[s];
    PoseBlock& pose = state.poses[static_cast<std::size_t>(stripe.view)];
    auto& plane = state.planes[static_cast<std::size_t>(stripe.laser)];
    for (std::size_t i = 0; i < stripe.pixel.size(); ++i) {
      if (!weights.stripe_used[s][i]) continue;
      const auto at =
          stripe_residual(state, shape, observations.axis, pose, plane, stripe.pixel[i]);
      if (!at) continue;
      const double weight = at->weight_px / (stripe.sigma_px[i] * weights.stripe_factor);
      StripeCost cost{state.camera.lens(), count, shape, stripe.pixel[i], at->ray, weight};
      problem.AddResidualBlock(autodiff<StripeCost, 1, 6, 2, 3>(cost, state.parameters.size()),
                               shared_loss(), state.parameters.data(), pose.data(),
                               state.bend.data(), plane.data());
    }
  }
}

// Holds or constrains the camera as the options say.
void constrain_camera(const JointOptions& options, JointState& state, ceres::Problem& problem) {
  double* const camera = state.parameters.data();
  const auto count = static_cast<int>(state.parameters.size());
  if (options.known_camera && !options.known_camera->covariance) {
    problem.SetParameterBlockConstant(camera);
    return;
  }
  if (options.known_camera) {
    const Eigen::MatrixXd& covariance = *options.known_camera->covariance;
    // A held coefficient has no variance: a floor well below anything that matters stands for it.
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
    const Eigen::VectorXd sqrt_information =
        eigen.eigenvalues().cwiseMax(1e-14).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd A = sqrt_information.asDiagonal() * eigen.eigenvectors().transpose();
    problem.AddResidualBlock(new ceres::NormalPrior(A, options.known_camera->camera.parameters()),
                             nullptr, camera);
    return;
  }
  if (options.hold_k3 && options.lens == LensModel::kPlumbBob)
    problem.SetManifold(camera, new ceres::SubsetManifold(count, {count - 1}));
}

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

// One residual's derivatives: by what is common to all views, and by the pose of its own view.
struct JacobianRow {
  Eigen::VectorXd shared;
  Vector6 own = Vector6::Zero();
  Eigen::Index pose = -1;

  JacobianRow(const ceres::CRSMatrix& J, int row, Eigen::Index common)
      : shared(Eigen::VectorXd::Zero(common)) {
    const auto r = static_cast<std::size_t>(row);
    for (int k = J.rows[r]; k < J.rows[r + 1]; ++k) {
      const Eigen::Index column = J.cols[static_cast<std::size_t>(k)];
      const double value = J.values[static_cast<std::size_t>(k)];
      if (column < common) {
        shared[column] = value;
      } else {
        pose = (column - common) / 6;
        own[(column - common) % 6] = value;
      }
    }
  }
};

// The normal matrix in its arrow shape: the common block, each pose's block, and what joins them.
struct Arrow {
  Eigen::MatrixXd common;
  std::vector<Eigen::MatrixXd> join;
  std::vector<Matrix6> pose;

  Arrow(Eigen::Index size, Eigen::Index poses)
      : common(Eigen::MatrixXd::Zero(size, size)),
        join(static_cast<std::size_t>(poses), Eigen::MatrixXd::Zero(size, 6)),
        pose(static_cast<std::size_t>(poses), Matrix6::Zero()) {}

  void add(const JacobianRow& row) {
    common.noalias() += row.shared * row.shared.transpose();
    if (row.pose < 0) return;
    const auto i = static_cast<std::size_t>(row.pose);
    join[i].noalias() += row.shared * row.own.transpose();
    pose[i].noalias() += row.own * row.own.transpose();
  }

  Eigen::MatrixXd schur() const {
    Eigen::MatrixXd matrix = common;
    for (std::size_t i = 0; i < pose.size(); ++i)
      matrix -= join[i] * pose[i].ldlt().solve(join[i].transpose());
    return matrix;
  }
};

// The diagonal of the hat matrix, from the inverse of the arrow.
class Shares {
 public:
  Shares(const Arrow& arrow, const Eigen::MatrixXd& schur)
      : common_(schur.ldlt().solve(Eigen::MatrixXd::Identity(schur.rows(), schur.cols()))) {
    for (std::size_t i = 0; i < arrow.pose.size(); ++i) {
      const Matrix6 inverse = arrow.pose[i].ldlt().solve(Matrix6::Identity());
      const Eigen::MatrixXd gain = inverse * arrow.join[i].transpose();  // 6 x common.
      join_.emplace_back(-common_ * gain.transpose());
      pose_.emplace_back(inverse + gain * common_ * gain.transpose());
    }
  }

  double of(const JacobianRow& row) const {
    double share = row.shared.dot(common_ * row.shared);
    if (row.pose < 0) return share;
    const auto i = static_cast<std::size_t>(row.pose);
    share += 2.0 * row.shared.dot(join_[i] * row.own) + row.own.dot(pose_[i] * row.own);
    return share;
  }

 private:
  Eigen::MatrixXd common_;
  std::vector<Eigen::MatrixXd> join_;
  std::vector<Matrix6> pose_;
};

}  // namespace

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
  add_corners(observations, weights, loss_sigmas, state, *problem);
  add_stripes(observations, weights, loss_sigmas, state, *problem);
  constrain_camera(options, state, *problem);
  if (!options.solve_bend) problem->SetParameterBlockConstant(state.bend.data());
  return problem;
}

std::optional<StripeResidual> stripe_residual(const JointState& state, const BendShape& shape,
                                              StripeAxis axis, const PoseBlock& pose,
                                              const std::array<double, 3>& plane,
                                              const Eigen::Vector2d& pixel) {
  const LensModel lens = state.camera.lens();
  const int count = static_cast<int>(state.parameters.size());
  Eigen::Vector2d guess((pixel.x() - state.parameters[2]) / state.parameters[0],
                        (pixel.y() - state.parameters[3]) / state.parameters[1]);
  const auto height = [&](const Eigen::Vector2d& at, Eigen::Vector2d& xy) -> double {
    if (!ray_of_pixel<double>(lens, state.parameters.data(), count, at, guess, xy)) return kNan;
    const Eigen::Vector3d p = point_on_board<double>(xy, pose.data(), state.bend.data(), shape);
    return Eigen::Map<const Eigen::Vector3d>(plane.data()).dot(p) - 1.0;
  };
  constexpr double kStepPx = 0.05;
  const Eigen::Vector2d step =
      axis == StripeAxis::kColumns ? Eigen::Vector2d(0.0, kStepPx) : Eigen::Vector2d(kStepPx, 0.0);
  Eigen::Vector2d ray;
  Eigen::Vector2d unused;
  const double at = height(pixel, ray);
  guess = ray;
  const double slope =
      (height(pixel + step, unused) - height(pixel - step, unused)) / (2 * kStepPx);
  if (!std::isfinite(at) || !std::isfinite(slope) || std::abs(slope) < 1e-12) return std::nullopt;
  return StripeResidual{at / slope, 1.0 / std::abs(slope), ray};
}

Eigen::Vector2d corner_residual(const JointState& state, const BendShape& shape,
                                const PoseBlock& pose, const Eigen::Vector2d& point_m,
                                const Eigen::Vector2d& pixel) {
  const CornerCost cost{state.camera.lens(), shape, point_m, pixel, 1.0};
  Eigen::Vector2d residual;
  if (!cost(state.parameters.data(), pose.data(), state.bend.data(), residual.data()))
    return {kNan, kNan};
  return residual;
}

ReducedInformation reduced_information(ceres::Problem& problem, JointState& state,
                                       int corner_numbers, int stripe_numbers) {
  ceres::Problem::EvaluateOptions options;
  options.apply_loss_function = false;
  ReducedInformation reduced;
  // Columns of the Jacobian in this order: camera, bend, planes, then the poses; held ones absent.
  const auto add = [&](double* block, int first, bool common) {
    if (problem.IsParameterBlockConstant(block)) return;
    options.parameter_blocks.push_back(block);
    const int free = problem.ParameterBlockTangentSize(block);
    for (int i = 0; common && i < free; ++i) reduced.parameter.push_back(first + i);
  };
  const int count = static_cast<int>(state.parameters.size());
  add(state.parameters.data(), 0, true);
  add(state.bend.data(), count, true);
  for (std::size_t i = 0; i < state.planes.size(); ++i)
    add(state.planes[i].data(), count + 2 + 3 * static_cast<int>(i), true);
  for (PoseBlock& pose : state.poses) add(pose.data(), 0, false);

  ceres::CRSMatrix J;
  problem.Evaluate(options, nullptr, nullptr, nullptr, &J);
  const auto common = static_cast<Eigen::Index>(reduced.parameter.size());
  Arrow arrow(common, (J.num_cols - common) / 6);
  for (int row = 0; row < J.num_rows; ++row) arrow.add(JacobianRow(J, row, common));
  reduced.matrix = arrow.schur();
  const Shares shares(arrow, reduced.matrix);
  for (int row = 0; row < std::min(J.num_rows, corner_numbers + stripe_numbers); ++row)
    (row < corner_numbers ? reduced.corner_share : reduced.stripe_share) +=
        shares.of(JacobianRow(J, row, common));
  return reduced;
}

}  // namespace striper::detail
