// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <numeric>

#include <ceres/solver.h>
#include <fmt/format.h>
#include <glog/logging.h>

#include <striper/adjust/solve_joint.hpp>
#include <striper/core/error.hpp>
#include <striper/intrinsics/initial_camera.hpp>
#include <striper/laser_plane/initial_plane.hpp>

#include "adjust/cost_functions/stripe_cost.hpp"
#include "adjust/joint_problem.hpp"
#include "adjust/residuals.hpp"
#include "adjust/uncertainty.hpp"

namespace striper {
namespace {

using detail::BendShape;
using detail::Counts;
using detail::JointState;
using detail::JointWeights;
using detail::Residuals;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kHuberSigmas = 2.0;

void require_enough(const Observations& observations, const JointOptions& options) {
  const std::size_t views = observations.views.size();
  if (!options.known_camera && views < 2)
    throw Error(ErrorKind::kUntrustworthy,
                fmt::format("the board was seen in {} image{}; the camera needs at least 3, "
                            "tilted differently",
                            views, views == 1 ? "" : "s"));
  if (options.known_camera && views == 0)
    throw Error(ErrorKind::kUntrustworthy, "the board was not seen in any image");
  for (int laser = 0; laser < observations.laser_count(); ++laser)
    if (std::none_of(observations.stripes.begin(), observations.stripes.end(),
                     [&](const StripeView& s) { return s.laser == laser && !s.pixel.empty(); }))
      throw Error(ErrorKind::kUntrustworthy,
                  fmt::format("laser {}: no stripe was found on the board in any image", laser));
}

JointState initial_state(const Observations& observations, const JointOptions& options) {
  JointState state;
  state.set_camera(options.known_camera ? options.known_camera->camera
                                        : initial_camera(observations, options.lens));
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
  state.set_camera(start.camera);
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
// summary says how it ended. The level is the whole process's: the first of the solves that run at
// the same time changes it, the last one puts it back.
class QuietSolver {
 public:
  QuietSolver() {
    const std::lock_guard lock(mutex);
    if (running++ > 0) return;
    before = FLAGS_minloglevel;
    FLAGS_minloglevel = std::max(before, static_cast<int>(google::GLOG_FATAL));
  }
  QuietSolver(const QuietSolver&) = delete;
  QuietSolver& operator=(const QuietSolver&) = delete;
  ~QuietSolver() {
    const std::lock_guard lock(mutex);
    if (--running == 0) FLAGS_minloglevel = before;
  }

 private:
  static inline std::mutex mutex;
  static inline int running = 0;
  static inline int before = 0;
};

// How far a solve goes: a robust one only has to tell the outliers, the last one gives the answer.
enum class Precision { kRough, kFull };

ceres::Solver::Summary run(const JointOptions& options, Precision precision, JointState& state,
                           ceres::Problem& problem) {
  const QuietSolver quiet;
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
  solver.function_tolerance = precision == Precision::kRough ? 1e-3 : 1e-10;
  solver.parameter_tolerance = precision == Precision::kRough ? 1e-5 : 1e-10;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  return summary;
}

void start_planes(const Observations& observations, JointState& state) {
  const BendShape shape(observations.board);
  const CameraModel camera = state.camera_now();
  for (int laser = 0; laser < observations.laser_count(); ++laser) {
    std::vector<Eigen::Vector3d> points_cam;
    for (const StripeView& stripe : observations.stripes) {
      if (stripe.laser != laser) continue;
      const auto& pose = state.poses[static_cast<std::size_t>(stripe.view)];
      for (const Eigen::Vector2d& pixel : stripe.pixel) {
        const Unprojection ray = camera.unproject(pixel);
        if (ray.status == CameraStatus::kOk)
          points_cam.push_back(
              detail::point_on_board<double>(ray.xy, pose.data(), state.bend.data(), shape));
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
    run(flat, Precision::kRough, state, *problem);
    estimate_sigmas(corners_only, options, compute_residuals(corners_only, state), weights);
  }
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

// How well the state fits: the residuals and what became of the points.
void put_residuals(const Observations& observations, const JointWeights& weights,
                   const Counts& counts, const JointState& state, JointSolution& solution) {
  Residuals residuals = compute_residuals(observations, state);
  solution.corners = corner_class(weights, residuals, counts);
  solution.stripes = stripe_class(observations, weights, residuals, counts);
  for (auto& view : residuals.corner_px)
    for (Eigen::Vector2d& r : view) r = -r;
  solution.corner_residual_px = std::move(residuals.corner_px);
  solution.stripe_residual_px = std::move(residuals.stripe_px);
  list_outliers(weights, solution);
}

void put_unknowns(const JointState& state, JointSolution& solution) {
  solution.camera = state.camera_now();
  for (const auto& plane : state.planes) solution.planes.push_back(detail::to_plane(plane));
  for (const auto& pose : state.poses) solution.T_cam_board.push_back(detail::to_isometry(pose));
  solution.bend_m = {state.bend[0], state.bend[1]};
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
  const bool was_robust = warm || (observations.stripes.empty() && !options.solve_bend);
  const int rounds = all_sigmas_given ? 2 : 3;
  ceres::Solver::Summary summary;
  std::unique_ptr<ceres::Problem> problem;
  for (int round = was_robust ? 1 : 0; round < rounds; ++round) {
    const bool robust = round == 0;
    const Residuals residuals = compute_residuals(observations, state);
    if (round < 2) estimate_sigmas(observations, options, residuals, weights);
    if (!robust) reject_outliers(observations, options, residuals, weights);
    problem =
        detail::make_problem(observations, options, weights, robust ? kHuberSigmas : 0.0, state);
    summary = run(options, robust ? Precision::kRough : Precision::kFull, state, *problem);
    if (!robust)
      refine_sigmas(observations, options, compute_residuals(observations, state),
                    count(weights, options, state), weights);
  }
  if (!all_sigmas_given)  // The information matrix is to carry the final sigmas.
    problem = detail::make_problem(observations, options, weights, 0.0, state);

  JointSolution solution;
  solution.converged = summary.termination_type == ceres::CONVERGENCE;
  solution.summary = summary.BriefReport();
  const Counts counts = count(weights, options, state);
  solution.unknowns = static_cast<int>(counts.camera_unknowns + counts.plane_unknowns);
  put_residuals(observations, weights, counts, state, solution);
  detail::fill_uncertainty(detail::linearise(*problem, state), counts, state, solution);
  if (options.known_camera && options.known_camera->covariance) {
    JointOptions freed = options;
    freed.known_camera.reset();
    freed.hold_k3 = false;
    problem = detail::make_problem(observations, freed, weights, 0.0, state);
    detail::add_known_camera(detail::linearise(*problem, state), *options.known_camera->covariance,
                             state, solution);
  }
  put_unknowns(state, solution);
  return solution;
}

double stripe_rms_px(const Observations& observations, const StripeView& stripe,
                     const CameraModel& camera, const Eigen::Isometry3d& T_cam_board,
                     const LaserPlane& plane, const Eigen::Vector2d& bend_m) {
  JointState state;
  state.set_camera(camera);
  state.bend = {bend_m.x(), bend_m.y()};
  state.planes.assign(static_cast<std::size_t>(stripe.laser) + 1, detail::to_block(plane));
  const detail::PoseBlock pose = detail::to_block(T_cam_board);
  std::vector<double> squares;
  for (std::size_t i = 0; i < stripe.pixel.size(); ++i)
    if (const auto at =
            detail::stripe_residual(state, observations.board, observations.axis, pose, stripe, i))
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
  run(options, Precision::kFull, state, *problem);
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
