// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include <Eigen/Dense>
#include <ceres/solver.h>
#include <fmt/format.h>
#include <glog/logging.h>

#include <striper/core/error.hpp>
#include <striper/intrinsics/initial_camera.hpp>
#include <striper/joint/solve_joint.hpp>
#include <striper/laser_plane/initial_plane.hpp>

#include "cost_functions/stripe_cost.hpp"
#include "joint/joint_problem.hpp"

namespace striper {
namespace {

using detail::BendShape;
using detail::JointState;
using detail::JointWeights;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kHuberSigmas = 2.0;
constexpr double kNormalMad = 1.4826;  // Of a normal distribution: sigma over median |x|.
constexpr double kSingular = 1e-13;    // Below this reciprocal condition no covariance is formed.

struct Residuals {
  std::vector<std::vector<Eigen::Vector2d>> corner_px;  // Projected minus observed.
  std::vector<std::vector<double>> stripe_px;
};

void require_enough(const Observations& observations, const JointOptions& options) {
  const std::size_t views = observations.views.size();
  if (!options.known_camera && views < 2)
    throw Error(ErrorKind::kUntrustworthy,
                fmt::format("the board was seen in {} picture{}; the camera needs at least 3, "
                            "tilted differently",
                            views, views == 1 ? "" : "s"));
  if (options.known_camera && views == 0)
    throw Error(ErrorKind::kUntrustworthy, "the board was not seen in any picture");
  for (int laser = 0; laser < observations.laser_count(); ++laser)
    if (std::none_of(observations.stripes.begin(), observations.stripes.end(),
                     [&](const StripeView& s) { return s.laser == laser && !s.pixel.empty(); }))
      throw Error(ErrorKind::kUntrustworthy,
                  fmt::format("laser {}: no stripe was found on the board in any picture", laser));
}

JointState initial_state(const Observations& observations, const JointOptions& options) {
  JointState state;
  state.camera = options.known_camera ? options.known_camera->camera
                                      : initial_camera(observations, options.lens);
  const Eigen::VectorXd parameters = state.camera.parameters();
  state.parameters.assign(parameters.data(), parameters.data() + parameters.size());
  for (const CornerView& view : observations.views) {
    const auto T_cam_board = initial_pose(state.camera, observations.board, view);
    if (!T_cam_board)
      throw Error(ErrorKind::kUntrustworthy,
                  fmt::format("'{}': the board's points give no pose", view.name));
    state.poses.push_back(detail::to_block(*T_cam_board));
  }
  return state;
}

JointState state_from(const JointSolution& start) {
  JointState state;
  state.camera = start.camera;
  const Eigen::VectorXd parameters = state.camera.parameters();
  state.parameters.assign(parameters.data(), parameters.data() + parameters.size());
  for (const Eigen::Isometry3d& T : start.T_cam_board) state.poses.push_back(detail::to_block(T));
  for (const LaserPlane& plane : start.planes) state.planes.push_back(detail::to_block(plane));
  state.bend = {start.bend_m.x(), start.bend_m.y()};
  return state;
}

JointWeights initial_weights(const Observations& observations, const JointOptions& options) {
  JointWeights weights;
  weights.corner_sigma_px = options.corner_sigma_px.value_or(0.15);
  for (const CornerView& view : observations.views)
    weights.corner_used.emplace_back(view.pixel.size(), 1);
  for (const StripeView& stripe : observations.stripes)
    weights.stripe_used.emplace_back(stripe.pixel.size(), 1);
  return weights;
}

// The solver's log goes to stderr, and a library does not print: a failed step is no news, the
// summary says how it ended.
void keep_solver_quiet() {
  static const bool once = [] {
    FLAGS_minloglevel = std::max(FLAGS_minloglevel, static_cast<int>(google::GLOG_FATAL));
    return true;
  }();
  static_cast<void>(once);
}

ceres::Solver::Summary run(const JointOptions& options, JointState& state,
                           ceres::Problem& problem) {
  keep_solver_quiet();
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_SCHUR;
  solver.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (auto& pose : state.poses) solver.linear_solver_ordering->AddElementToGroup(pose.data(), 0);
  solver.linear_solver_ordering->AddElementToGroup(state.parameters.data(), 1);
  solver.linear_solver_ordering->AddElementToGroup(state.bend.data(), 1);
  for (auto& plane : state.planes)
    solver.linear_solver_ordering->AddElementToGroup(plane.data(), 1);
  solver.max_num_iterations = options.max_iterations;
  solver.num_threads = options.threads;
  solver.function_tolerance = 1e-10;
  solver.parameter_tolerance = 1e-10;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  return summary;
}

void start_planes(const Observations& observations, JointState& state) {
  const BendShape shape(observations.board);
  for (int laser = 0; laser < observations.laser_count(); ++laser) {
    std::vector<Eigen::Vector3d> points_cam;
    for (const StripeView& stripe : observations.stripes) {
      if (stripe.laser != laser) continue;
      const auto& pose = state.poses[static_cast<std::size_t>(stripe.view)];
      for (const Eigen::Vector2d& pixel : stripe.pixel) {
        const Eigen::Vector2d guess((pixel.x() - state.parameters[2]) / state.parameters[0],
                                    (pixel.y() - state.parameters[3]) / state.parameters[1]);
        Eigen::Vector2d xy;
        if (detail::ray_of_pixel<double>(state.camera.lens(), state.parameters.data(),
                                         static_cast<int>(state.parameters.size()), pixel, guess,
                                         xy))
          points_cam.push_back(
              detail::point_on_board<double>(xy, pose.data(), state.bend.data(), shape));
      }
    }
    const auto plane = fit_plane(points_cam);
    if (!plane || plane->distance_m() < 1e-6)
      throw Error(
          ErrorKind::kUntrustworthy,
          fmt::format("laser {}: the stripes seen on the boards give no plane: they all lie "
                      "on one line, or the plane passes through the camera; move the "
                      "board to other distances and tilts",
                      laser));
    state.planes.push_back(detail::to_block(*plane));
  }
}

Residuals compute_residuals(const Observations& observations, const JointState& state) {
  const BendShape shape(observations.board);
  Residuals residuals;
  for (std::size_t v = 0; v < observations.views.size(); ++v) {
    const CornerView& view = observations.views[v];
    auto& row = residuals.corner_px.emplace_back();
    for (std::size_t i = 0; i < view.pixel.size(); ++i)
      row.push_back(detail::corner_residual(
          state, shape, state.poses[v], observations.board.point_m(view.point[i]), view.pixel[i]));
  }
  for (const StripeView& stripe : observations.stripes) {
    auto& row = residuals.stripe_px.emplace_back();
    for (const Eigen::Vector2d& pixel : stripe.pixel) {
      const auto at = state.planes.empty()
                          ? std::nullopt
                          : detail::stripe_residual(
                                state, shape, observations.axis,
                                state.poses[static_cast<std::size_t>(stripe.view)],
                                state.planes[static_cast<std::size_t>(stripe.laser)], pixel);
      row.push_back(at ? at->residual_px : kNan);
    }
  }
  return residuals;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The spread of the corners' coordinates, by the median: outliers do not count.
double robust_corner_sigma_px(const Residuals& residuals) {
  std::vector<double> magnitudes;
  for (const auto& view : residuals.corner_px)
    for (const Eigen::Vector2d& r : view)
      if (r.allFinite()) magnitudes.insert(magnitudes.end(), {std::abs(r.x()), std::abs(r.y())});
  return std::max(kNormalMad * median(std::move(magnitudes)), 1e-6);
}

double robust_stripe_factor(const Observations& observations, const Residuals& residuals) {
  std::vector<double> magnitudes;
  for (std::size_t s = 0; s < residuals.stripe_px.size(); ++s)
    for (std::size_t i = 0; i < residuals.stripe_px[s].size(); ++i)
      if (std::isfinite(residuals.stripe_px[s][i]))
        magnitudes.push_back(std::abs(residuals.stripe_px[s][i]) /
                             observations.stripes[s].sigma_px[i]);
  return std::max(kNormalMad * median(std::move(magnitudes)), 1e-6);
}

void estimate_sigmas(const Observations& observations, const JointOptions& options,
                     const Residuals& residuals, JointWeights& weights) {
  if (!options.corner_sigma_px) weights.corner_sigma_px = robust_corner_sigma_px(residuals);
  if (!options.trust_stripe_sigma && !observations.stripes.empty())
    weights.stripe_factor = robust_stripe_factor(observations, residuals);
}

void reject_outliers(const Observations& observations, const JointOptions& options,
                     const Residuals& residuals, JointWeights& weights) {
  const double limit = options.remove_outliers ? options.outlier_sigmas : 1e300;
  for (std::size_t v = 0; v < residuals.corner_px.size(); ++v)
    for (std::size_t i = 0; i < residuals.corner_px[v].size(); ++i)
      weights.corner_used[v][i] =
          residuals.corner_px[v][i].cwiseAbs().maxCoeff() <= limit * weights.corner_sigma_px;
  for (std::size_t s = 0; s < residuals.stripe_px.size(); ++s)
    for (std::size_t i = 0; i < residuals.stripe_px[s].size(); ++i)
      weights.stripe_used[s][i] =
          std::abs(residuals.stripe_px[s][i]) <=
          limit * weights.stripe_factor * observations.stripes[s].sigma_px[i];
}

// Fits once without stripes, to have poses to place the stripes on.
void solve_camera(const Observations& observations, const JointOptions& options,
                  JointWeights& weights, JointState& state) {
  Observations corners_only = observations;
  corners_only.stripes.clear();
  JointOptions flat = options;
  flat.solve_bend = false;
  // The lens comes last: from poses found without distortion, all at once may run away.
  for (const double sigma_px : {1.0, weights.corner_sigma_px}) {
    JointWeights stage = weights;
    stage.corner_sigma_px = sigma_px;
    const auto problem = detail::make_problem(corners_only, flat, stage,
                                              sigma_px == 1.0 ? 3.0 : kHuberSigmas, state);
    run(flat, state, *problem);
    if (!options.corner_sigma_px)
      weights.corner_sigma_px = robust_corner_sigma_px(compute_residuals(corners_only, state));
  }
}

struct Counts {
  double corner_numbers = 0.0;
  double stripe_numbers = 0.0;
  double camera_unknowns = 0.0;  // Camera, bend and poses: the corners' share.
  double plane_unknowns = 0.0;
};

Counts count(const JointWeights& weights, const JointOptions& options, const JointState& state) {
  Counts counts;
  for (const auto& view : weights.corner_used)
    counts.corner_numbers += 2.0 * static_cast<double>(std::count(view.begin(), view.end(), 1));
  for (const auto& stripe : weights.stripe_used)
    counts.stripe_numbers += static_cast<double>(std::count(stripe.begin(), stripe.end(), 1));
  counts.camera_unknowns = 6.0 * static_cast<double>(state.poses.size());
  if (!options.known_camera)
    counts.camera_unknowns += static_cast<double>(state.parameters.size()) - options.hold_k3;
  if (options.solve_bend) counts.camera_unknowns += 2.0;
  counts.plane_unknowns = 3.0 * static_cast<double>(state.planes.size());
  return counts;
}

ResidualClass corner_class(const JointWeights& weights, const Residuals& residuals,
                           const Counts& counts) {
  ResidualClass c;
  double sum = 0.0;
  for (std::size_t v = 0; v < residuals.corner_px.size(); ++v)
    for (std::size_t i = 0; i < residuals.corner_px[v].size(); ++i)
      if (weights.corner_used[v][i] && residuals.corner_px[v][i].allFinite())
        sum += residuals.corner_px[v][i].squaredNorm();
  c.dof = counts.corner_numbers - counts.camera_unknowns;
  c.rms_px = std::sqrt(sum / std::max(0.5 * counts.corner_numbers, 1.0));
  c.sigma_px = weights.corner_sigma_px;
  c.chi2 = sum / (weights.corner_sigma_px * weights.corner_sigma_px);
  return c;
}

ResidualClass stripe_class(const Observations& observations, const JointWeights& weights,
                           const Residuals& residuals, const Counts& counts) {
  ResidualClass c;
  double sum = 0.0;
  std::vector<double> sigmas;
  for (std::size_t s = 0; s < residuals.stripe_px.size(); ++s)
    for (std::size_t i = 0; i < residuals.stripe_px[s].size(); ++i) {
      // A pixel can lose its ray while the lens is still moving; it then has no residual.
      if (!weights.stripe_used[s][i] || !std::isfinite(residuals.stripe_px[s][i])) continue;
      const double sigma_px = weights.stripe_factor * observations.stripes[s].sigma_px[i];
      const double r = residuals.stripe_px[s][i];
      sum += r * r;
      c.chi2 += r * r / (sigma_px * sigma_px);
      sigmas.push_back(sigma_px);
    }
  c.dof = counts.stripe_numbers - counts.plane_unknowns;
  c.rms_px = std::sqrt(sum / std::max(counts.stripe_numbers, 1.0));
  c.sigma_px = median(std::move(sigmas));
  c.sigma_factor = weights.stripe_factor;
  return c;
}

// Sharpens the measured sigmas with the degrees of freedom, now that the outliers are out.
void refine_sigmas(const Observations& observations, const JointOptions& options,
                   const Residuals& residuals, const Counts& counts, JointWeights& weights) {
  if (!options.corner_sigma_px && counts.corner_numbers > counts.camera_unknowns)
    weights.corner_sigma_px *= std::sqrt(corner_class(weights, residuals, counts).chi2_per_dof());
  if (!options.trust_stripe_sigma && counts.stripe_numbers > counts.plane_unknowns)
    weights.stripe_factor *=
        std::sqrt(stripe_class(observations, weights, residuals, counts).chi2_per_dof());
  weights.corner_sigma_px = std::max(weights.corner_sigma_px, 1e-6);
  weights.stripe_factor = std::max(weights.stripe_factor, 1e-6);
}

std::vector<std::string> reduced_names(const CameraModel& camera, std::size_t planes) {
  std::vector<std::string> names;
  for (const auto name : camera.parameter_names()) names.emplace_back(name);
  names.insert(names.end(), {"bend_x", "bend_y"});
  for (std::size_t i = 0; i < planes; ++i)
    for (const char axis : {'x', 'y', 'z'}) names.push_back(fmt::format("laser{}_{}", i, axis));
  return names;
}

// d (n, d) / d w for w = n / d.
Eigen::Matrix<double, 4, 3> plane_jacobian(const std::array<double, 3>& block) {
  const Eigen::Vector3d w(block[0], block[1], block[2]);
  const double d = 1.0 / w.norm();
  const Eigen::Vector3d n = d * w;
  Eigen::Matrix<double, 4, 3> J;
  J.topRows<3>() = d * (Eigen::Matrix3d::Identity() - n * n.transpose());
  J.row(3) = -d * d * n.transpose();
  return J;
}

// From the solver's unknowns to the model file's.
Eigen::MatrixXd file_covariance(const detail::ReducedInformation& reduced,
                                const Eigen::MatrixXd& inverse, const JointState& state) {
  const auto camera = static_cast<Eigen::Index>(state.parameters.size());
  const auto planes = static_cast<Eigen::Index>(state.planes.size());
  Eigen::MatrixXd to_file = Eigen::MatrixXd::Zero(camera + 4 * planes, inverse.rows());
  for (Eigen::Index column = 0; column < inverse.cols(); ++column) {
    const Eigen::Index parameter = reduced.parameter[static_cast<std::size_t>(column)];
    if (parameter < camera) {
      to_file(parameter, column) = 1.0;
    } else if (parameter >= camera + 2) {
      const Eigen::Index plane = (parameter - camera - 2) / 3;
      to_file.block<4, 1>(camera + 4 * plane, column) =
          plane_jacobian(state.planes[static_cast<std::size_t>(plane)])
              .col((parameter - camera - 2) % 3);
    }
  }
  const Eigen::MatrixXd covariance = to_file * inverse * to_file.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

void fill_covariance(ceres::Problem& problem, const Counts& counts, JointState& state,
                     JointSolution& solution) {
  const detail::ReducedInformation reduced =
      detail::reduced_information(problem, state, static_cast<int>(counts.corner_numbers),
                                  static_cast<int>(counts.stripe_numbers));
  const Eigen::Index size = reduced.matrix.rows();
  if (size == 0) return;
  const Eigen::VectorXd scale =
      reduced.matrix.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      Eigen::MatrixXd(scale.asDiagonal() * reduced.matrix * scale.asDiagonal()));
  solution.rcond = std::max(eigen.eigenvalues()[0], 0.0) / eigen.eigenvalues()[size - 1];
  const std::vector<std::string> names = reduced_names(state.camera, state.planes.size());
  for (Eigen::Index i = 0; i < size; ++i)
    solution.weakest.emplace_back(
        names[static_cast<std::size_t>(reduced.parameter[static_cast<std::size_t>(i)])],
        std::abs(eigen.eigenvectors()(i, 0)));
  std::sort(solution.weakest.begin(), solution.weakest.end(),
            [](const auto& a, const auto& b) { return a.second > b.second; });
  if (solution.rcond < kSingular || !reduced.matrix.allFinite()) return;
  // The stripes take part in the poses too: each class loses the unknowns that it determines.
  if (std::isfinite(reduced.corner_share) && std::isfinite(reduced.stripe_share)) {
    solution.corners.dof = counts.corner_numbers - reduced.corner_share;
    if (counts.stripe_numbers > 0.0)
      solution.stripes.dof = counts.stripe_numbers - reduced.stripe_share;
  }
  const Eigen::MatrixXd root = scale.asDiagonal() * eigen.eigenvectors() *
                               eigen.eigenvalues().cwiseSqrt().cwiseInverse().asDiagonal();
  const Eigen::MatrixXd inverse = root * root.transpose();
  solution.covariance = file_covariance(reduced, inverse, state);
  const auto camera = static_cast<int>(state.parameters.size());
  for (Eigen::Index i = 0; i + 1 < size; ++i)
    if (reduced.parameter[static_cast<std::size_t>(i)] == camera)
      solution.bend_covariance = inverse.block<2, 2>(i, i);
}

void list_outliers(const JointWeights& weights, JointSolution& solution) {
  for (std::size_t v = 0; v < solution.corner_residual_px.size(); ++v)
    for (std::size_t i = 0; i < solution.corner_residual_px[v].size(); ++i) {
      if (weights.corner_used[v][i]) continue;
      Eigen::Vector2d& r = solution.corner_residual_px[v][i];
      solution.outliers.push_back({static_cast<int>(v), false, static_cast<int>(i), r.norm()});
      r.setConstant(kNan);
    }
  for (std::size_t s = 0; s < solution.stripe_residual_px.size(); ++s)
    for (std::size_t i = 0; i < solution.stripe_residual_px[s].size(); ++i) {
      if (weights.stripe_used[s][i]) continue;
      double& r = solution.stripe_residual_px[s][i];
      solution.outliers.push_back({static_cast<int>(s), true, static_cast<int>(i), std::abs(r)});
      r = kNan;
    }
}

JointSolution package(const Observations& observations, const JointOptions& options,
                      const JointWeights& weights, const JointState& state) {
  JointSolution solution;
  solution.camera = state.camera_now();
  for (const auto& plane : state.planes) solution.planes.push_back(detail::to_plane(plane));
  for (const auto& pose : state.poses) solution.T_cam_board.push_back(detail::to_isometry(pose));
  solution.bend_m = {state.bend[0], state.bend[1]};
  Residuals residuals = compute_residuals(observations, state);
  const Counts counts = count(weights, options, state);
  solution.corners = corner_class(weights, residuals, counts);
  solution.stripes = stripe_class(observations, weights, residuals, counts);
  solution.unknowns = static_cast<int>(counts.camera_unknowns + counts.plane_unknowns);
  for (auto& view : residuals.corner_px)
    for (Eigen::Vector2d& r : view) r = -r;
  solution.corner_residual_px = std::move(residuals.corner_px);
  solution.stripe_residual_px = std::move(residuals.stripe_px);
  list_outliers(weights, solution);
  return solution;
}

}  // namespace

double JointSolution::view_rms_px(std::size_t view) const {
  double sum = 0.0;
  int used = 0;
  for (const Eigen::Vector2d& r : corner_residual_px[view])
    if (r.allFinite()) sum += r.squaredNorm(), ++used;
  return used > 0 ? std::sqrt(sum / used) : kNan;
}

double JointSolution::stripe_rms_px(std::size_t stripe) const {
  double sum = 0.0;
  int used = 0;
  for (const double r : stripe_residual_px[stripe])
    if (std::isfinite(r)) sum += r * r, ++used;
  return used > 0 ? std::sqrt(sum / used) : kNan;
}

std::vector<std::string> covariance_names(const CameraModel& camera, std::size_t planes) {
  std::vector<std::string> names;
  for (const auto name : camera.parameter_names()) names.emplace_back(name);
  for (std::size_t i = 0; i < planes; ++i)
    for (const char* part : {"nx", "ny", "nz", "d"})
      names.push_back(fmt::format("laser{}_{}", i, part));
  return names;
}

JointSolution solve_joint(const Observations& observations, const JointOptions& given) {
  observations.validate();
  JointOptions options = given;
  if (options.known_camera) options.lens = options.known_camera->camera.lens();
  require_enough(observations, options);
  const bool warm = options.start != nullptr;
  JointState state = warm ? state_from(*options.start) : initial_state(observations, options);
  JointWeights weights = initial_weights(observations, options);
  if (!warm) {
    solve_camera(observations, options, weights, state);
    start_planes(observations, state);
  }

  // Robust, then least squares on what is left, then once more with the sigmas so measured.
  const bool all_sigmas_given =
      options.corner_sigma_px && (options.trust_stripe_sigma || observations.stripes.empty());
  const int rounds = all_sigmas_given ? 2 : 3;
  ceres::Solver::Summary summary;
  std::unique_ptr<ceres::Problem> problem;
  for (int round = warm ? 1 : 0; round < rounds; ++round) {
    const Residuals residuals = compute_residuals(observations, state);
    if (round < 2) estimate_sigmas(observations, options, residuals, weights);
    if (round > 0) reject_outliers(observations, options, residuals, weights);
    problem = detail::make_problem(observations, options, weights, round == 0 ? kHuberSigmas : 0.0,
                                   state);
    summary = run(options, state, *problem);
    if (round > 0)
      refine_sigmas(observations, options, compute_residuals(observations, state),
                    count(weights, options, state), weights);
  }
  if (!all_sigmas_given)  // The information matrix is to carry the final sigmas.
    problem = detail::make_problem(observations, options, weights, 0.0, state);
  JointSolution solution = package(observations, options, weights, state);
  solution.converged = summary.termination_type == ceres::CONVERGENCE;
  solution.summary = summary.BriefReport();
  fill_covariance(*problem, count(weights, options, state), state, solution);
  return solution;
}

double stripe_rms_px(const Observations& observations, const StripeView& stripe,
                     const CameraModel& camera, const Eigen::Isometry3d& T_cam_board,
                     const LaserPlane& plane, const Eigen::Vector2d& bend_m) {
  JointState state;
  state.camera = camera;
  const Eigen::VectorXd parameters = camera.parameters();
  state.parameters.assign(parameters.data(), parameters.data() + parameters.size());
  state.bend = {bend_m.x(), bend_m.y()};
  const BendShape shape(observations.board);
  std::vector<double> squares;
  for (const Eigen::Vector2d& pixel : stripe.pixel)
    if (const auto at =
            detail::stripe_residual(state, shape, observations.axis, detail::to_block(T_cam_board),
                                    detail::to_block(plane), pixel))
      squares.push_back(at->residual_px * at->residual_px);
  if (squares.empty()) return kNan;
  return std::sqrt(std::accumulate(squares.begin(), squares.end(), 0.0) /
                   static_cast<double>(squares.size()));
}

std::vector<Eigen::Vector3d> stripe_points_cam(const Observations& observations,
                                               const JointSolution& solution, int laser) {
  JointState state = state_from(solution);
  const BendShape shape(observations.board);
  std::vector<Eigen::Vector3d> points;
  for (std::size_t s = 0; s < observations.stripes.size(); ++s) {
    const StripeView& stripe = observations.stripes[s];
    if (stripe.laser != laser) continue;
    const auto& pose = state.poses[static_cast<std::size_t>(stripe.view)];
    for (std::size_t i = 0; i < stripe.pixel.size(); ++i) {
      if (!std::isfinite(solution.stripe_residual_px[s][i])) continue;
      const Unprojection ray = solution.camera.unproject(stripe.pixel[i]);
      if (ray.status != CameraStatus::kOk) continue;
      points.push_back(
          detail::point_on_board<double>(ray.xy, pose.data(), state.bend.data(), shape));
    }
  }
  return points;
}

Eigen::Isometry3d solve_pose(const CameraModel& camera, const Board& board, const CornerView& view,
                             const Eigen::Vector2d& bend_m, double* corner_rms_px) {
  Observations one;
  one.board = board;
  one.image_width = camera.width();
  one.image_height = camera.height();
  one.views = {view};
  JointOptions options;
  options.lens = camera.lens();
  options.known_camera = KnownCamera{camera, std::nullopt};
  options.corner_sigma_px = 1.0;
  JointState state = initial_state(one, options);
  state.bend = {bend_m.x(), bend_m.y()};
  const JointWeights weights = initial_weights(one, options);
  const auto problem = detail::make_problem(one, options, weights, 0.0, state);
  run(options, state, *problem);
  if (corner_rms_px != nullptr) {
    double sum = 0.0;
    const Residuals residuals = compute_residuals(one, state);
    for (const Eigen::Vector2d& r : residuals.corner_px[0]) sum += r.squaredNorm();
    *corner_rms_px =
        std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, view.pixel.size())));
  }
  return detail::to_isometry(state.poses[0]);
}

}  // namespace striper
