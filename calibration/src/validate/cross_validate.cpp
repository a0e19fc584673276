// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <random>
#include <thread>

#include <Eigen/Dense>

#include <striper/core/error.hpp>
#include <striper/core/statistics.hpp>
#include <striper/validate/cross_validation.hpp>

namespace striper {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kSplits = 6;
constexpr int kMostHoldOuts = 20;
constexpr std::size_t kFewestForSplit = 8;

// Runs jobs 0 to count - 1 on some threads; a job that throws Error is skipped by itself.
template <typename Job>
void in_parallel(int count, int threads, const Job& job) {
  std::atomic<int> next{0};
  const auto work = [&] {
    for (int i = next++; i < count; i = next++) job(i);
  };
  std::vector<std::thread> others;
  for (int t = 1; t < threads; ++t) others.emplace_back(work);
  work();
  for (std::thread& thread : others) thread.join();
}

// The part of a solution that belongs to some of its views.
JointSolution subset(const JointSolution& solution, const std::vector<int>& views) {
  JointSolution part = solution;
  part.T_cam_board.clear();
  for (const int v : views)
    part.T_cam_board.push_back(solution.T_cam_board[static_cast<std::size_t>(v)]);
  return part;
}

// Picks what both halves estimate: free camera parameters and three numbers per plane.
Eigen::MatrixXd selection(const JointSolution& solution, bool camera_is_given) {
  const auto camera = solution.camera.parameters().size();
  const auto planes = static_cast<Eigen::Index>(solution.planes.size());
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < camera && !camera_is_given; ++i)
    if (solution.covariance(i, i) > 0.0) free.push_back(i);
  const auto count = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(count + 3 * planes, camera + 4 * planes);
  for (Eigen::Index i = 0; i < count; ++i) S(i, free[static_cast<std::size_t>(i)]) = 1.0;
  for (Eigen::Index p = 0; p < planes; ++p) {
    const Eigen::Vector3d n = solution.planes[static_cast<std::size_t>(p)].normal();
    const Eigen::Vector3d a = n.unitOrthogonal();
    S.block<1, 3>(count + 3 * p, camera + 4 * p) = a.transpose();
    S.block<1, 3>(count + 3 * p + 1, camera + 4 * p) = n.cross(a).transpose();
    S(count + 3 * p + 2, camera + 4 * p + 3) = 1.0;
  }
  return S;
}

Eigen::VectorXd stacked(const JointSolution& solution) {
  const Eigen::VectorXd camera = solution.camera.parameters();
  Eigen::VectorXd all(camera.size() + 4 * static_cast<Eigen::Index>(solution.planes.size()));
  all.head(camera.size()) = camera;
  for (std::size_t p = 0; p < solution.planes.size(); ++p)
    all.segment<4>(camera.size() + 4 * static_cast<Eigen::Index>(p)) << solution.planes[p].normal(),
        solution.planes[p].distance_m();
  return all;
}

// Normalised estimation error squared of two independent solutions; NaN where one is singular.
double nees_of(const JointSolution& a, const JointSolution& b, const Eigen::MatrixXd& S) {
  if (a.covariance.size() == 0 || b.covariance.size() == 0) return kNan;
  const Eigen::VectorXd e = S * (stacked(a) - stacked(b));
  const Eigen::MatrixXd C = S * (a.covariance + b.covariance) * S.transpose();
  const Eigen::VectorXd scale = C.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::VectorXd scaled = scale.asDiagonal() * e;
  return scaled.dot(
      Eigen::MatrixXd(scale.asDiagonal() * C * scale.asDiagonal()).ldlt().solve(scaled));
}

// Halves of the views at random, the views with a stripe shared out evenly too.
std::pair<std::vector<int>, std::vector<int>> split_views(const Observations& observations,
                                                          unsigned seed) {
  std::vector<char> has_stripe(observations.views.size(), 0);
  for (const StripeView& s : observations.stripes) has_stripe[static_cast<std::size_t>(s.view)] = 1;
  std::mt19937 generator(seed);  // NOLINT: the same splits every time is what is wanted.
  std::pair<std::vector<int>, std::vector<int>> halves;
  for (const char kind : {1, 0}) {
    std::vector<int> views;
    for (std::size_t v = 0; v < has_stripe.size(); ++v)
      if (has_stripe[v] == kind) views.push_back(static_cast<int>(v));
    for (std::size_t i = views.size(); i > 1; --i) std::swap(views[i - 1], views[generator() % i]);
    for (std::size_t i = 0; i < views.size(); ++i)
      (halves.first.size() <= halves.second.size() ? halves.first : halves.second)
          .push_back(views[i]);
  }
  std::sort(halves.first.begin(), halves.first.end());
  std::sort(halves.second.begin(), halves.second.end());
  return halves;
}

JointOptions same_sigmas(const JointSolution& solution, const JointOptions& options) {
  JointOptions same = options;
  same.corner_sigma_px = solution.corners.sigma_px;
  same.trust_stripe_sigma = true;
  // A camera that is given is common to all parts: its error does not show in what they differ by.
  if (same.known_camera) same.known_camera->covariance.reset();
  return same;
}

// The stripes with the factor that the whole session gave them.
Observations with_final_sigmas(const Observations& observations, const JointSolution& solution) {
  Observations scaled = observations;
  for (StripeView& stripe : scaled.stripes)
    for (double& sigma_px : stripe.sigma_px) sigma_px *= solution.stripes.sigma_factor;
  return scaled;
}

void split_half(const Observations& observations, const JointSolution& solution,
                const JointOptions& options, int threads, CrossValidation& result) {
  if (observations.views.size() < kFewestForSplit || solution.covariance.size() == 0) return;
  const Eigen::MatrixXd S = selection(solution, options.known_camera.has_value());
  if (S.rows() == 0) return;
  std::vector<double> nees(kSplits, kNan);
  in_parallel(kSplits, threads, [&](int split) {
    const auto [first, second] = split_views(observations, 20u + static_cast<unsigned>(split));
    try {
      JointOptions half = same_sigmas(solution, options);
      half.threads = 1;
      const JointSolution start_a = subset(solution, first);
      const JointSolution start_b = subset(solution, second);
      half.start = &start_a;
      const JointSolution a = solve_joint(observations.subset(first), half);
      half.start = &start_b;
      const JointSolution b = solve_joint(observations.subset(second), half);
      if (a.planes.size() == solution.planes.size() && b.planes.size() == solution.planes.size())
        nees[static_cast<std::size_t>(split)] = nees_of(a, b, S);
    } catch (const Error&) {
      // A half that determines nothing has no say.
    }
  });
  double sum = 0.0;
  for (const double value : nees)
    if (std::isfinite(value)) sum += value, ++result.splits;
  if (result.splits == 0) return;
  result.nees = sum / result.splits;
  result.dof = static_cast<double>(S.rows());
  result.nees_low = chi2_quantile(0.025, result.dof);
  result.nees_high = chi2_quantile(0.975, result.dof);
  if (result.nees > chi2_quantile(0.995, result.dof))
    result.covariance_factor = result.nees / result.dof;
}

// Solves without some views and predicts these.
void hold_out(const Observations& observations, const JointSolution& solution,
              const JointOptions& options, const std::vector<int>& held, CrossValidation& result) {
  std::vector<int> others;
  for (int v = 0; v < static_cast<int>(observations.views.size()); ++v)
    if (std::find(held.begin(), held.end(), v) == held.end()) others.push_back(v);
  JointOptions warm = same_sigmas(solution, options);
  warm.threads = 1;
  const JointSolution start = subset(solution, others);
  warm.start = &start;
  const JointSolution rest = solve_joint(observations.subset(others), warm);
  for (const int view : held) {
    const auto v = static_cast<std::size_t>(view);
    const Eigen::Isometry3d T = solve_pose(rest.camera, observations.board, observations.views[v],
                                           rest.bend_m, &result.held_out_corner_px[v]);
    for (std::size_t s = 0; s < observations.stripes.size(); ++s) {
      const StripeView& stripe = observations.stripes[s];
      const auto laser = static_cast<std::size_t>(stripe.laser);
      if (stripe.view != view || laser >= rest.planes.size()) continue;
      result.held_out_stripe_px[s] =
          stripe_rms_px(observations, stripe, rest.camera, T, rest.planes[laser], rest.bend_m);
    }
  }
}

// One view at a time where there are few; else in groups, each view held out once.
void leave_one_out(const Observations& observations, const JointSolution& solution,
                   const JointOptions& options, int threads, CrossValidation& result) {
  const auto count = static_cast<int>(observations.views.size());
  result.held_out_corner_px.assign(observations.views.size(), kNan);
  result.held_out_stripe_px.assign(observations.stripes.size(), kNan);
  if (count < 4) return;
  const int groups = std::min(count, kMostHoldOuts);
  in_parallel(groups, threads, [&](int group) {
    std::vector<int> held;
    for (int v = group; v < count; v += groups) held.push_back(v);
    try {
      hold_out(observations, solution, options, held, result);
    } catch (const Error&) {
      // Without these views there is no solution: they stay NaN and are reported as such.
    }
  });
}

double rms_of(const std::vector<double>& values) {
  double sum = 0.0;
  int count = 0;
  for (const double v : values)
    if (std::isfinite(v)) sum += v * v, ++count;
  return count > 0 ? std::sqrt(sum / count) : kNan;
}

}  // namespace

double CrossValidation::corner_rms_px() const { return rms_of(held_out_corner_px); }
double CrossValidation::stripe_rms_px() const { return rms_of(held_out_stripe_px); }

CrossValidation cross_validate(const Observations& observations, const JointSolution& solution,
                               const JointOptions& options, int threads) {
  const Observations scaled = with_final_sigmas(observations, solution);
  CrossValidation result;
  split_half(scaled, solution, options, threads, result);
  leave_one_out(scaled, solution, options, threads, result);
  return result;
}

}  // namespace striper
