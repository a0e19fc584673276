// SPDX-License-Identifier: Apache-2.0
#include "stripe/track/bridged_gaps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <striper/geometry/line_fit.hpp>

#include "core/pixel_box.hpp"
#include "stripe/edges/edge_view.hpp"
#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

// Of how many sure returns on either side the line is, and over how many scan lines.
constexpr float kSure = 0.99F;
constexpr int kMostAsked = 12;
constexpr int kLeastAsked = 6;
constexpr int kReach = 60;
constexpr double kLeastSigma_px = 0.1;  // No return is known better, for a line over many of them.
constexpr double kMostScatter = 9.0;    // Chi squared over its degrees of freedom: it is no line.
constexpr double kMostUncertain_px = 0.4;
constexpr double kOffLine_px = 0.5;  // A stripe on a straight surface leaves its line by no more.

// Fits from the steepest places of the profile, of which two may be the stripe's own flanks.
constexpr std::size_t kStarts = 4;
constexpr double kSeenContrast = 0.7;
constexpr double kPartOfAmplitude = 0.5;  // A dark surface has less than those that are sure.
constexpr int kFirstSteps = 8;
constexpr int kMostSteps = 30;
// That no light is there: its amplitude, DN, and how sure that is.
constexpr double kNone_dn = 0.5;
constexpr double kNoneSigma_dn = 0.01;

// What is taken: of 100 rooms 478 of 481, of 24 boards 1632 of 1651 and of a board session 259 of
// 259 (stripe_choice_table's, from 1 on) are right. Beside fainter edges textures are taken for the
// stripe.
constexpr double kLeastContrast = 0.6;
constexpr double kMostMisfit = 1.6;   // Of the pixels that the stripe is on,
constexpr double kMostBeside = 20.0;  // and of all: other edges are near.
constexpr double kMostSigma_px = 0.4;
constexpr double kMostOff = 3.0;     // Sigmas off the line,
constexpr double kLeastGain = 25.0;  // and what the light explains: chi squared.

bool may_be_bridged(ReturnStatus status) {
  return status != ReturnStatus::kOk && status != ReturnStatus::kBlind &&
         status != ReturnStatus::kEdge;
}

struct Steep {
  double at = 0.0;
  double slope = 0.0;  // DN of two pixels.
};

// The steepest places of the profile, each steeper than those beside it.
std::array<Steep, kStarts> steepest_of(const EdgeProfile& profile) {
  std::array<Steep, kStarts> steepest{};
  const auto slope_at = [&](std::size_t i) { return profile.lit[i + 1] - profile.lit[i - 1]; };
  for (std::size_t i = 1; i + 1 < profile.count; ++i) {
    const double slope = slope_at(i);
    const bool is_peak = (i == 1 || std::abs(slope) >= std::abs(slope_at(i - 1))) &&
                         (i + 2 == profile.count || std::abs(slope) > std::abs(slope_at(i + 1)));
    Steep& least = *std::min_element(
        steepest.begin(), steepest.end(),
        [](const Steep& a, const Steep& b) { return std::abs(a.slope) < std::abs(b.slope); });
    if (is_peak && std::abs(slope) > std::abs(least.slope)) least = {profile.at[i], slope};
  }
  return steepest;
}

// What the laser adds at the stripe's middle, on the side of the edge that it is on.
double height_of(const EdgeModel& model) {
  const double off = model.of[EdgeModel::kPosition] - model.of[EdgeModel::kEdge];
  const double side = std::erf(off / (model.of[EdgeModel::kBlur] * std::numbers::sqrt2));
  return model.of[EdgeModel::kAmplitude] * (1.0 + model.of[EdgeModel::kContrast] * side);
}

// How much more the model explains with the stripe's light than without.
double gain_of(const EdgeProfile& profile, const PlanNoise& noise, EdgePrior prior,
               const EdgeEstimate& found) {
  prior.mean.of[EdgeModel::kAmplitude] = kNone_dn;
  prior.sigma[EdgeModel::kAmplitude] = kNoneSigma_dn;
  EdgeModel start = found.model;
  start.of[EdgeModel::kAmplitude] = kNone_dn;
  return fit_edge(profile, noise, prior, start, EdgeKind::kReflectance, kMostSteps).cost -
         found.cost;
}

}  // namespace

void BridgedGaps::measure(const FrameAtHand& at_hand, const WidthModel& width, Stripe& stripe) {
  lines_.clear();
  lines_.reserve(stripe.size());
  find_sure(stripe);
  const AxisGrid& across = grid_across(stripe.grid, stripe.axis);
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (!may_be_bridged(stripe.status[i])) continue;
    const auto expected = expected_at(stripe.line[i]);
    if (!expected) continue;
    const double own_width = without_pixel_box(width.at(expected->position));
    const auto found = fit(at_hand, own_width, stripe.line[i], *expected);
    if (!found) continue;
    stripe.across_px[i] = across.sensor(found->model.of[EdgeModel::kPosition]);
    stripe.sigma_px[i] = static_cast<float>(across.step * std::sqrt(found->variance));
    stripe.amplitude_dn[i] = static_cast<float>(height_of(found->model));
    stripe.width_px[i] = static_cast<float>(across.step * found->model.of[EdgeModel::kWidth]);
    stripe.confidence[i] = kConfidence;
    stripe.status[i] = ReturnStatus::kOk;
    lines_.push_back(stripe.line[i]);
  }
}

void BridgedGaps::find_sure(const Stripe& stripe) {
  const AxisGrid& across = grid_across(stripe.grid, stripe.axis);
  sure_.clear();
  sure_.reserve(stripe.size());
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (stripe.status[i] != ReturnStatus::kOk || stripe.confidence[i] < kSure) continue;
    const double sigma = static_cast<double>(stripe.sigma_px[i]) / across.step;
    sure_.push_back({stripe.line[i], across.index(stripe.across_px[i]),
                     std::hypot(sigma, kLeastSigma_px),
                     static_cast<double>(stripe.amplitude_dn[i])});
  }
}

// The nearest on both sides; empty where there are too few on one.
std::span<const BridgedGaps::Sure> BridgedGaps::about(int line) const {
  const auto before = [](const Sure& sure, int number) { return sure.line < number; };
  const auto after = std::lower_bound(sure_.begin(), sure_.end(), line, before);
  auto first = after;
  while (first != sure_.begin() && after - first < kMostAsked && (first - 1)->line >= line - kReach)
    --first;
  auto last = after;
  while (last != sure_.end() && last - after < kMostAsked && last->line <= line + kReach) ++last;
  if (after - first < kLeastAsked || last - after < kLeastAsked) return {};
  return {first, last};
}

std::optional<BridgedGaps::Expected> BridgedGaps::expected_at(int line) const {
  const std::span<const Sure> asked = about(line);
  if (asked.empty()) return std::nullopt;
  LineSums sums;
  double amplitude = 0.0;
  for (const Sure& sure : asked) {
    sums.add(1.0, sure.line - line, sure.position, 1.0 / (sure.sigma * sure.sigma));
    amplitude += sure.amplitude / static_cast<double>(asked.size());
  }
  const LineFit fitted = sums.solve();
  const double scatter = std::max(1.0, fitted.chi2 / fitted.dof());
  const double sigma = std::sqrt(fitted.variance_at(1.0, 0.0) * scatter);
  if (scatter > kMostScatter || !(sigma < kMostUncertain_px)) return std::nullopt;
  return Expected{fitted.at(1.0, 0.0), sigma, amplitude};
}

std::optional<EdgeEstimate> BridgedGaps::fit(const FrameAtHand& at_hand, double width, int line,
                                             const Expected& expected) const {
  const EdgeProfile profile =
      edge_profile_at(at_hand.frame, at_hand.axis, line, expected.position, with_pixel_box(width));
  const PlanNoise& noise = at_hand.noise;
  EdgePrior prior = edge_prior(at_hand.frame, noise, profile, expected.position,
                               kPartOfAmplitude * expected.amplitude, width);
  prior.sigma[EdgeModel::kPosition] = std::hypot(expected.sigma, kOffLine_px);
  EdgeEstimate best;
  for (const Steep& steep : steepest_of(profile)) {
    if (steep.slope == 0.0) continue;
    EdgeModel start = prior.mean;
    start.of[EdgeModel::kEdge] = steep.at;
    start.of[EdgeModel::kContrast] = std::copysign(kSeenContrast, steep.slope);
    const EdgeEstimate found =
        fit_edge(profile, noise, prior, start, EdgeKind::kReflectance, kFirstSteps);
    if (best.variance < 0.0 || found.cost < best.cost) best = found;
  }
  if (best.variance < 0.0) return std::nullopt;
  best = fit_edge(profile, noise, prior, best.model, EdgeKind::kReflectance, kMostSteps);
  const double off = std::abs(best.model.of[EdgeModel::kPosition] - expected.position);
  const double most_off2 = kMostOff * kMostOff * (best.variance + expected.sigma * expected.sigma);
  const bool is_there = best.variance > 0.0 && best.variance < kMostSigma_px * kMostSigma_px &&
                        best.core_misfit < kMostMisfit && best.misfit < kMostBeside &&
                        off < kOffLine_px && off * off < most_off2 &&
                        std::abs(best.model.of[EdgeModel::kContrast]) > kLeastContrast;
  if (!is_there || gain_of(profile, noise, prior, best) < kLeastGain) return std::nullopt;
  return best;
}

}  // namespace striper::detail
