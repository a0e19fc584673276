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
#include "stripe/select/forests/choice_trees.hpp"

namespace striper::detail {
namespace {

// Of how many sure returns on either side the line is, and over how many scan lines.
constexpr int kMostAsked = 12;
constexpr int kLeastAsked = 4;
constexpr int kReach = 150;
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
constexpr double kAnyWidths = 4.0;  // That the blur of an edge alone is a part of.

// What is taken: chosen on stripe_choice_table's rooms and sessions from 1 on, of which its table
// of confidences says how often .99 to .999 is right. Beside fainter edges textures are taken for
// the stripe.
constexpr double kLeastContrast = 0.5;
constexpr double kMostMisfit = 2.2;   // Of the pixels that the stripe is on,
constexpr double kMostBeside = 20.0;  // and of all: other edges are near.
constexpr double kMostSigma_px = 0.4;
constexpr double kMostOff = 3.0;      // Sigmas off the line,
constexpr double kMostHeights = 2.0;  // Of the highest of the sure returns.
constexpr double kWholeWidths = 1.5;  // On either side of the middle no pixel is masked.
constexpr double kLeastGain = 16.0;   // and what the light explains: chi squared.

// What is there by itself, or what a limit of the user's refused, stays as it is.
bool may_be_bridged(ReturnStatus status) {
  return status == ReturnStatus::kNoStripe || status == ReturnStatus::kOutlier ||
         status == ReturnStatus::kAmbiguous || status == ReturnStatus::kNarrow ||
         status == ReturnStatus::kWide;
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

// How much more the model explains with the stripe's light than without. An edge alone may be as
// soft as it likes: a shadow's, or one out of focus.
double gain_of(const EdgeProfile& profile, const PlanNoise& noise, EdgePrior prior,
               const EdgeEstimate& found) {
  prior.mean.of[EdgeModel::kAmplitude] = kNone_dn;
  prior.sigma[EdgeModel::kAmplitude] = kNoneSigma_dn;
  prior.sigma[EdgeModel::kBlur] = 0.0;
  prior.sigma[EdgeModel::kWidth] = kAnyWidths * prior.mean.of[EdgeModel::kWidth];
  EdgeModel start = found.model;
  start.of[EdgeModel::kAmplitude] = kNone_dn;
  return fit_edge(profile, noise, prior, start, EdgeKind::kReflectance, kMostSteps).cost -
         found.cost;
}

// Whether no pixel that the stripe is on is masked.
bool is_whole(const EdgeProfile& profile, const EdgeModel& model) {
  const double position = model.of[EdgeModel::kPosition];
  const double reach = kWholeWidths * with_pixel_box(model.of[EdgeModel::kWidth]);
  const auto first = static_cast<int>(std::ceil(position - reach));
  const auto last = static_cast<int>(std::floor(position + reach));
  const auto seen = std::count_if(profile.at.begin(),
                                  profile.at.begin() + static_cast<std::ptrdiff_t>(profile.count),
                                  [&](double at) { return at >= first && at <= last; });
  return seen == last - first + 1;
}

bool is_searched(const BridgedGaps::Measured& frame, int line, double position) {
  const FrameAtHand& at_hand = frame.at_hand;
  const SearchedPart& part = frame.part;
  if (at_hand.ignored.has(at_hand.axis, line, static_cast<int>(std::lround(position))))
    return false;
  return !part.is_limited() || (position >= static_cast<double>(part.first_of(line)) &&
                                position <= static_cast<double>(part.last_of(line)));
}

bool is_high(const BridgedGaps::Measured& frame, const EdgeModel& model) {
  const double height_dn = height_of(model);
  const double value_dn = model.of[EdgeModel::kBlack] + height_dn;
  const double noise_dn = std::sqrt(frame.at_hand.noise.model.variance_dn2(value_dn));
  return height_dn >= frame.least_dn && height_dn >= frame.least_snr * noise_dn;
}

}  // namespace

void BridgedGaps::begin(std::size_t lines) {
  lines_.clear();
  lines_.reserve(lines);
  sure_.reserve(lines);
}

void BridgedGaps::measure(const Measured& frame, Stripe& stripe) {
  find_sure(stripe);
  const AxisGrid& across = grid_across(stripe.grid, stripe.axis);
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (!may_be_bridged(stripe.status[i])) continue;
    const int line = stripe.line[i];
    const auto expected = expected_at(line);
    if (!expected || !is_searched(frame, line, expected->position)) continue;
    const double own_width = without_pixel_box(frame.width.at(expected->position));
    const auto found = fit(frame, own_width, line, *expected);
    if (!found || !is_searched(frame, line, found->model.of[EdgeModel::kPosition])) continue;
    const double sigma = std::sqrt(found->variance * std::max(1.0, found->core_misfit));
    stripe.across_px[i] = across.sensor(found->model.of[EdgeModel::kPosition]);
    stripe.sigma_px[i] = static_cast<float>(std::hypot(across.step * sigma, frame.excess_sigma_px));
    stripe.amplitude_dn[i] = static_cast<float>(height_of(found->model));
    stripe.width_px[i] = static_cast<float>(across.step * found->model.of[EdgeModel::kWidth]);
    stripe.confidence[i] = kConfidence;
    stripe.status[i] = ReturnStatus::kOk;
    lines_.push_back(line);
  }
}

void BridgedGaps::find_sure(const Stripe& stripe) {
  const AxisGrid& across = grid_across(stripe.grid, stripe.axis);
  sure_.clear();
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
  double most = 0.0;
  for (const Sure& sure : asked) {
    sums.add(1.0, sure.line - line, sure.position, 1.0 / (sure.sigma * sure.sigma));
    amplitude += sure.amplitude / static_cast<double>(asked.size());
    most = std::max(most, sure.amplitude);
  }
  const LineFit fitted = sums.solve();
  const double scatter = std::max(1.0, fitted.chi2 / fitted.dof());
  const double sigma = std::sqrt(fitted.variance_at(1.0, 0.0) * scatter);
  if (scatter > kMostScatter || !(sigma < kMostUncertain_px)) return std::nullopt;
  return Expected{fitted.at(1.0, 0.0), sigma, amplitude, most};
}

std::optional<EdgeEstimate> BridgedGaps::fit(const Measured& frame, double width, int line,
                                             const Expected& expected) {
  const FrameAtHand& at_hand = frame.at_hand;
  const EdgeProfile profile =
      edge_profile_at(at_hand.frame, at_hand.axis, line, expected.position, with_pixel_box(width));
  const PlanNoise& noise = at_hand.noise;
  EdgePrior prior = edge_prior(at_hand.frame, noise, profile, expected.position,
                               kPartOfAmplitude * expected.amplitude, width);
  prior.sigma[EdgeModel::kPosition] = std::hypot(expected.sigma, kOffLine_px);
  std::array<EdgeModel, kStarts> starts;
  std::size_t count = 0;
  for (const Steep& steep : steepest_of(profile)) {
    if (steep.slope == 0.0) continue;
    EdgeModel& start = starts[count++] = prior.mean;
    start.of[EdgeModel::kEdge] = steep.at;
    start.of[EdgeModel::kContrast] = std::copysign(kSeenContrast, steep.slope);
  }
  const EdgeEstimate best =
      fit_edge_from({starts.data(), count}, profile, noise, prior, kFirstSteps, kMostSteps);
  const double off = std::abs(best.model.of[EdgeModel::kPosition] - expected.position);
  const double most_off2 = kMostOff * kMostOff * (best.variance + expected.sigma * expected.sigma);
  const bool is_there = best.variance > 0.0 && best.variance < kMostSigma_px * kMostSigma_px &&
                        best.core_misfit < kMostMisfit && best.misfit < kMostBeside &&
                        off < kOffLine_px && off * off < most_off2 &&
                        std::abs(best.model.of[EdgeModel::kContrast]) > kLeastContrast;
  const bool is_like_them = height_of(best.model) < kMostHeights * expected.most_amplitude &&
                            is_high(frame, best.model) && is_whole(profile, best.model);
  if (!is_there || !is_like_them || gain_of(profile, noise, prior, best) < kLeastGain)
    return std::nullopt;
  return best;
}

}  // namespace striper::detail
