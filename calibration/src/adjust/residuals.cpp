// SPDX-License-Identifier: Apache-2.0
#include "adjust/residuals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <striper/core/robust.hpp>

namespace striper::detail {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kLeastSigma = 1e-6;

// By the median: outliers do not count.
double sigma_of(std::vector<double> magnitudes) {
  return magnitudes.empty() ? kLeastSigma : std::max(robust_sigma(magnitudes), kLeastSigma);
}

// The spread of the corners' coordinates.
double robust_corner_sigma_px(const Residuals& residuals) {
  std::vector<double> magnitudes;
  for (const auto& view : residuals.corner_px)
    for (const Eigen::Vector2d& r : view)
      if (r.allFinite()) magnitudes.insert(magnitudes.end(), {std::abs(r.x()), std::abs(r.y())});
  return sigma_of(std::move(magnitudes));
}

double robust_stripe_factor(const Observations& observations, const Residuals& residuals) {
  std::vector<double> magnitudes;
  for (std::size_t s = 0; s < residuals.stripe_px.size(); ++s)
    for (std::size_t i = 0; i < residuals.stripe_px[s].size(); ++i)
      if (std::isfinite(residuals.stripe_px[s][i]))
        magnitudes.push_back(std::abs(residuals.stripe_px[s][i]) /
                             observations.stripes[s].sigma_px[i]);
  return sigma_of(std::move(magnitudes));
}

}  // namespace

Residuals compute_residuals(const Observations& observations, const JointState& state) {
  Residuals residuals;
  for (std::size_t v = 0; v < observations.views.size(); ++v) {
    const CornerView& view = observations.views[v];
    auto& row = residuals.corner_px.emplace_back();
    for (std::size_t i = 0; i < view.pixel.size(); ++i)
      row.push_back(
          corner_residual(state, observations.board, state.poses[v], view.point[i], view.pixel[i]));
  }
  for (const StripeView& stripe : observations.stripes) {
    auto& row = residuals.stripe_px.emplace_back();
    for (std::size_t i = 0; i < stripe.pixel.size(); ++i) {
      const auto at =
          state.planes.empty()
              ? std::nullopt
              : stripe_residual(state, observations.board, observations.axis,
                                state.poses[static_cast<std::size_t>(stripe.view)], stripe, i);
      row.push_back(at ? at->residual_px : kNan);
    }
  }
  return residuals;
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
  if (!sigmas.empty()) c.sigma_px = upper_median(sigmas);
  c.sigma_factor = weights.stripe_factor;
  return c;
}

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

}  // namespace striper::detail
