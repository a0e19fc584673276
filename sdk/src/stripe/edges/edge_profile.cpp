// SPDX-License-Identifier: Apache-2.0
#include "stripe/edges/edge_profile.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/small_ldlt.hpp"
#include "stripe/edges/edge_normal.hpp"

namespace striper::detail {
namespace {

constexpr double kMostContrast = 0.98;
constexpr double kLeastBlur = 0.15;      // Pixels: no lens is sharper.
constexpr double kMostOfWidth = 0.95;    // The blur is a part of the stripe's width.
constexpr double kLeastAmplitude = 0.5;  // DN.
constexpr double kSettled = 1e-3;        // Of the cost.
constexpr double kFirstDamping = 1e-2;
constexpr double kMostDamping = 1e4;
constexpr double kFitted = 6.0;        // Parameters that the pixels, not the priors, determine.
constexpr double kFittedToCore = 3.0;  // Of them to those that the stripe is on.
constexpr double kLeastFreedom = 3.0;

using Solver = SmallLdlt<EdgeModel::kCount>;
using Vector = Solver::Vector;

// The normal equations at one model, and what of it costs.
struct Normal {
  EdgeNormal of;  // With the priors' part of the derivatives.
  double cost;    // Chi squared with the priors' part.
};

Normal normal_at(const EdgeProfile& profile, const PlanNoise& noise, const EdgePrior& prior,
                 const EdgeModel& model, EdgeKind kind) {
  Normal normal{edge_normal(profile, noise, model, kind), 0.0};
  normal.cost = normal.of.chi2;
  for (std::size_t i = 0; i < EdgeModel::kCount; ++i) {
    if (!(prior.sigma[i] > 0.0)) continue;
    const double per_variance = 1.0 / (prior.sigma[i] * prior.sigma[i]);
    const double off = prior.mean.of[i] - model.of[i];
    normal.cost += off * off * per_variance;
    normal.of.gradient[i] += off * per_variance;
    normal.of.information[i][i] += per_variance;
  }
  return normal;
}

EdgeModel moved(const EdgeModel& model, const Vector& step) {
  EdgeModel m = model;
  for (std::size_t i = 0; i < EdgeModel::kCount; ++i) m.of[i] += step[i];
  double& contrast = m.of[EdgeModel::kContrast];
  contrast = std::clamp(contrast, -kMostContrast, kMostContrast);
  m.of[EdgeModel::kAmplitude] = std::max(kLeastAmplitude, m.of[EdgeModel::kAmplitude]);
  m.of[EdgeModel::kAmbient] = std::max(0.0, m.of[EdgeModel::kAmbient]);
  const double before = model.of[EdgeModel::kWidth];
  double& width = m.of[EdgeModel::kWidth];
  width = std::clamp(width, 0.7 * before, 1.4 * before);
  double& blur = m.of[EdgeModel::kBlur];
  blur = std::clamp(blur, std::min(kLeastBlur, 0.5 * width), kMostOfWidth * width);
  return m;
}

// A fit on its way.
class EdgeFit {
 public:
  EdgeFit(const EdgeProfile& profile, const PlanNoise& noise, const EdgePrior& prior,
          const EdgeModel& start, EdgeKind kind)
      : profile_(&profile), noise_(&noise), prior_(&prior), kind_(kind) {
    model_ = moved(start, Vector{});
    normal_ = normal_at(profile, noise, prior, model_, kind);
  }

  double cost() const { return normal_.cost; }

  // So many steps more, or until it is settled; after others anew, as little damped as at first.
  void advance(int most_steps) {
    damping_ = kFirstDamping;
    is_settled_ = false;
    for (int step = 0; step < most_steps && !is_settled_ && damping_ < kMostDamping; ++step) {
      take_step();
    }
  }

  EdgeEstimate estimate() const {
    EdgeEstimate found;
    found.model = model_;
    found.cost = normal_.cost;
    const EdgeNormal& of = normal_.of;
    found.misfit = of.chi2 / std::max(kLeastFreedom, of.rows - kFitted);
    found.core_misfit = of.core_chi2 / std::max(kLeastFreedom, of.core_rows - kFittedToCore);
    const Solver solver(of.information);
    if (!solver.is_positive()) return found;
    Vector unit{};
    unit[EdgeModel::kPosition] = 1.0;
    const double variance = solver.solve(unit)[EdgeModel::kPosition];
    found.variance = std::isfinite(variance) ? variance : -1.0;
    return found;
  }

 private:
  void take_step() {
    Solver::Matrix damped = normal_.of.information;
    for (std::size_t i = 0; i < EdgeModel::kCount; ++i) damped[i][i] *= 1.0 + damping_;
    const Solver solver(damped);
    if (!solver.is_positive()) {
      damping_ *= 10.0;
      return;
    }
    const EdgeModel next = moved(model_, solver.solve(normal_.of.gradient));
    const Normal there = normal_at(*profile_, *noise_, *prior_, next, kind_);
    if (!(there.cost < normal_.cost)) {
      damping_ *= 10.0;
      return;
    }
    is_settled_ = normal_.cost - there.cost < kSettled * (1.0 + there.cost);
    model_ = next;
    normal_ = there;
    damping_ *= 0.1;
  }

  const EdgeProfile* profile_;
  const PlanNoise* noise_;
  const EdgePrior* prior_;
  EdgeKind kind_;
  EdgeModel model_;
  Normal normal_;
  double damping_ = kFirstDamping;
  bool is_settled_ = false;
};

}  // namespace

EdgeEstimate fit_edge(const EdgeProfile& profile, const PlanNoise& noise, const EdgePrior& prior,
                      const EdgeModel& start, EdgeKind kind, int most_steps) {
  EdgeFit fit(profile, noise, prior, start, kind);
  fit.advance(most_steps);
  return fit.estimate();
}

EdgeEstimate fit_edge_from(std::span<const EdgeModel> starts, const EdgeProfile& profile,
                           const PlanNoise& noise, const EdgePrior& prior, int first_steps,
                           int most_steps) {
  if (starts.empty()) return {};
  std::optional<EdgeFit> best;
  for (const EdgeModel& start : starts) {
    EdgeFit fit(profile, noise, prior, start, EdgeKind::kReflectance);
    fit.advance(first_steps);
    if (!best || !(best->cost() <= fit.cost())) best = fit;
  }
  best->advance(most_steps);
  return best->estimate();
}

}  // namespace striper::detail
