// SPDX-License-Identifier: Apache-2.0
#include "stripe/track/bridged_gaps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/pixel_box.hpp"
#include "stripe/edges/edge_view.hpp"
#include "stripe/profile/line_view.hpp"
#include "stripe/select/forests/choice_trees.hpp"
#include "stripe/select/texture_beside.hpp"
#include "stripe/track/evidence_scale.hpp"
#include "stripe/track/place_evidence.hpp"

namespace striper::detail {
namespace {

constexpr double kLeastSigma_px = 0.1;  // No return is known better, for a line over many of them.
constexpr double kLeastBridgedSigma_px = 0.15;  // What was bridged is held to the line already.
constexpr double kMostApart = 3.0;              // Sigmas, what either side says alone.
// What a stripe on a straight surface leaves its line by: of such lines as are trusted
// (SureReturns) one robust sigma is .05 px in sessions, .06 in rooms, of fits that .15 held to them
// .11 and .12 (96000 on).
constexpr double kOffLine_px = 0.05;
constexpr double kMostOffLine_px = 0.5;  // At most. A fit that is free to leave the line
constexpr double kFree_px = 0.15;        // tells whether it would.
constexpr double kPartDrawn = 0.75;      // Of that way, the error that is told.

// Fits from the steepest places of the profile, of which two may be the stripe's own flanks.
constexpr std::size_t kStarts = 4;
constexpr double kSeenContrast = 0.7;
constexpr double kPartOfAmplitude = 0.5;  // A dark surface has less than those that are sure.
constexpr int kFirstSteps = 5;
constexpr int kMostSteps = 30;
// That no light is there: its amplitude, DN, and how sure that is.
constexpr double kNone_dn = 0.5;
constexpr double kNoneSigma_dn = 0.01;
constexpr double kAnyWidths = 4.0;  // That the blur of an edge alone is a part of.

// What is measured: the networks, which tell more, are fitted to such. With a least gain of 16
// sessions (96000 to 96023) lost .14 % of their stripe, with one of 6 they won .03.
constexpr double kMostSigma_px = 0.5;       // Of the fit, by noise alone,
constexpr double kMostError_px = 1.0;       // and all in all.
constexpr double kWholeWidths = 1.5;        // On either side of the middle no pixel is masked.
constexpr double kMostMisfit = 60.0;        // Of the pixels that the stripe is on,
constexpr double kMostMisfitOfAll = 300.0;  // and of all.
constexpr double kMostHeights = 4.0;        // Of the highest of the sure returns.
constexpr double kLeastGain = 12.0;         // Chi squared: the scan line itself shows light.
// Where fewer scan lines beside were measured so it is to show as much: else three times as many
// lines without light, beside a soft edge, were taken (bridged_gaps_test).
constexpr double kLeastGainAlone = 16.0;
constexpr float kLeastBeside = 2.0F;
constexpr double kLeastGainOverMisfit = 1.0;  // Of all pixels: texture is no light.
constexpr int kBesideLines = 3;               // Scan lines to either side that bear it out.

// With .99 what was taken behind a post of data/scenes/room.yaml, on the wall's line, rose by a
// fifth (stripe_error_bars_test); with .995 sessions (96000 to 96023) lose .2 % of their stripe.
constexpr float kTaken = 0.9925F;
constexpr int kMostPasses = 3;  // What was taken is sure for those about it.

constexpr float kMostOdds = 8.0F;  // Of evidence: what is surer is not told apart.

// Which of these it is depends on the confidence that was asked for.
bool is_told_by_confidence(ReturnStatus status) {
  return status == ReturnStatus::kOk || status == ReturnStatus::kOutlier ||
         status == ReturnStatus::kNarrow || status == ReturnStatus::kWide;
}

bool is_sure(const Stripe& stripe, std::size_t i) {
  return is_told_by_confidence(stripe.status[i]) && stripe.confidence[i] >= kSure;
}

// What is there for sure, by itself or below a limit of the user's, stays as it is.
bool may_be_bridged(const Stripe& stripe, std::size_t i) {
  const ReturnStatus status = stripe.status[i];
  if (is_told_by_confidence(status)) return !is_sure(stripe, i);
  if (status == ReturnStatus::kWeak) return stripe.confidence[i] < kSure;
  return status == ReturnStatus::kNoStripe || status == ReturnStatus::kAmbiguous;
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

// The reflectance at the stripe's middle, over the mean of both sides.
double reflectance_of(const EdgeModel& model) {
  const double off = model.of[EdgeModel::kPosition] - model.of[EdgeModel::kEdge];
  const double side = std::erf(off / (model.of[EdgeModel::kBlur] * std::numbers::sqrt2));
  return 1.0 + model.of[EdgeModel::kContrast] * side;
}

// What the laser adds there.
double height_of(const EdgeModel& model) {
  return model.of[EdgeModel::kAmplitude] * reflectance_of(model);
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
  const double daylight_dn = model.of[EdgeModel::kAmbient] * reflectance_of(model);
  const double value_dn = model.of[EdgeModel::kBlack] + daylight_dn + height_dn;
  const double noise_dn = std::sqrt(frame.at_hand.noise.model.variance_dn2(value_dn));
  return height_dn >= frame.least_dn && height_dn >= frame.least_snr * noise_dn;
}

// By how much what is measured is doubted beyond its fit: where the light draws it off the line, or
// would if it were free, or where the returns beside are on another line, either may be right.
double doubt_px(const ExpectedPlace& expected, double off_px, double free_off_px) {
  const double apart_px = std::abs(expected.near.position - expected.position);
  const double drawn_px = std::max({off_px, kPartDrawn * free_off_px, kPartDrawn * apart_px});
  return std::max(0.0, drawn_px - kOffLine_px);
}

float explained_by(const BridgedGaps::Bridge& bridge) {
  return bridge.evidence.of[BridgeEvidence::kGain];
}

// Whether the scan line shows light for sure, or not by itself alone.
bool is_lit(const BridgedGaps::Bridge& bridge) {
  const auto& of = bridge.evidence.of;
  return of[BridgeEvidence::kGain] >= log2_of(1.0 + kLeastGainAlone) ||
         of[BridgeEvidence::kBeside] >= kLeastBeside;
}

// @param step of the image's pixels, in the sensor's.
bool agree(const BridgedGaps::Bridge& a, const BridgedGaps::Bridge& b, double step) {
  const double most_px = kMostApart * std::hypot(a.sigma_px, b.sigma_px);
  return std::abs(a.across_px - b.across_px) <= std::min(kMostOffLine_px * step, most_px);
}

// Of a stripe with one element per scan line.
std::size_t element_of(const BridgedGaps::Bridge& bridge) {
  return static_cast<std::size_t>(bridge.line);
}

float log_odds_of(const Stripe& stripe, std::size_t i, float most) {
  const float confidence = stripe.confidence[i];
  return std::clamp(std::log(confidence / (1.0F - confidence)), -most, most);
}

}  // namespace

void BridgedGaps::begin(std::size_t lines) {
  bridges_.clear();
  bridges_.reserve(lines);
  sure_.begin(lines);
  is_in_vain_.assign(lines, 0);
}

bool BridgedGaps::has(int line) const noexcept {
  const auto at = std::lower_bound(bridges_.begin(), bridges_.end(), line,
                                   [](const Bridge& b, int number) { return b.line < number; });
  return at != bridges_.end() && at->line == line && at->is_taken;
}

void BridgedGaps::measure(const Measured& frame, Stripe& stripe) {
  if (!stripe.is_seen) return;  // Then nothing is sure, whatever its confidence.
  look_at_frame(frame, stripe);
  bool has_more = true;
  for (int pass = 0; pass < kMostPasses && has_more; ++pass) {
    find_sure(stripe);
    measure_gaps(frame, stripe);
    has_more = take_sure(frame.least_probability, stripe);
  }
}

// Anew, but for those that were taken.
void BridgedGaps::measure_gaps(const Measured& frame, const Stripe& stripe) {
  std::erase_if(bridges_, [](const Bridge& bridge) { return !bridge.is_taken; });
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (is_in_vain_[i] || !may_be_bridged(stripe, i)) continue;
    const std::optional<Bridge> bridge = measured_at(frame, stripe.line[i], stripe);
    if (!bridge) continue;
    is_in_vain_[i] = 0;
    bridges_.push_back(*bridge);
  }
  std::sort(bridges_.begin(), bridges_.end(),
            [](const Bridge& a, const Bridge& b) { return a.line < b.line; });
}

// Rates them, takes what is sure, and says whether any was.
bool BridgedGaps::take_sure(double least_probability, Stripe& stripe) {
  bool any = false;
  for (std::size_t k = 0; k < bridges_.size(); ++k) {
    Bridge& bridge = bridges_[k];
    if (bridge.is_taken) continue;
    add_beside(k);
    bridge.probability = bridge_probability(bridge.evidence);
    bridge.is_taken = bridge.probability >= kTaken && is_lit(bridge) &&
                      !(bridge.probability <= stripe.confidence[element_of(bridge)]);
    if (bridge.is_taken) take(bridge, least_probability, stripe);
    any = any || bridge.is_taken;
  }
  return any;
}

// By the returns on both sides; where these lie on no line, by those on one side alone; nothing
// where the two sides disagree.
std::optional<BridgedGaps::Bridge> BridgedGaps::measured_at(const Measured& frame, int line,
                                                            const Stripe& stripe) {
  const SureBeside sure = sure_.beside(line);
  if (const auto expected = sure_.expected_at(line, sure))
    return measured_by(*expected, frame, stripe);
  if (sure.is_one_sided()) return std::nullopt;
  const auto measured_by_side = [&](const SureBeside& side) -> std::optional<Bridge> {
    const auto expected = sure_.expected_at(line, side);
    return expected ? measured_by(*expected, frame, stripe) : std::nullopt;
  };
  const std::optional<Bridge> before = measured_by_side({sure.before, {}});
  const std::optional<Bridge> after = measured_by_side({{}, sure.after});
  if (!before || !after) return before ? before : after;
  const double step = grid_across(stripe.grid, stripe.axis).step;
  if (!agree(*before, *after, step)) return std::nullopt;
  return explained_by(*before) >= explained_by(*after) ? before : after;
}

std::optional<BridgedGaps::Bridge> BridgedGaps::measured_by(const ExpectedPlace& expected,
                                                            const Measured& frame,
                                                            const Stripe& stripe) {
  is_in_vain_[static_cast<std::size_t>(expected.line)] = 1;
  if (!is_searched(frame, expected.line, expected.position)) return std::nullopt;
  const double own_width = without_pixel_box(frame.width.at(expected.position));
  const auto fitted = fit(frame, own_width, expected);
  if (!fitted) return std::nullopt;
  const EdgeEstimate& found = fitted->estimate;
  const double position = found.model.of[EdgeModel::kPosition];
  if (!is_searched(frame, expected.line, position)) return std::nullopt;

  const double off_px = position - expected.position;
  const double sigma = std::hypot(std::sqrt(found.variance * std::max(1.0, found.core_misfit)),
                                  doubt_px(expected, std::abs(off_px), fitted->free_off_px));
  if (!(sigma < kMostError_px)) return std::nullopt;

  const AxisGrid& across = grid_across(stripe.grid, stripe.axis);
  Bridge bridge{.line = expected.line,
                .across_px = across.sensor(position),
                .sigma_px = std::hypot(across.step * sigma, frame.excess_sigma_px),
                .amplitude_dn = height_of(found.model),
                .width_px = across.step * found.model.of[EdgeModel::kWidth],
                .off_px = off_px};
  BridgeEvidence& e = bridge.evidence;
  e = of_frame_;
  add_fit(*fitted, own_width, e);
  e.of[BridgeEvidence::kTexture] = log2_ratio(
      bridge.amplitude_dn,
      texture_beside(frame.at_hand.frame, frame.at_hand.axis, expected.line,
                     static_cast<float>(position), static_cast<float>(with_pixel_box(own_width))));
  add_place(expected,
            {position, std::sqrt(found.variance), bridge.amplitude_dn, fitted->free_off_px}, e);
  add_own(bridge, stripe, e);
  return bridge;
}

void BridgedGaps::take(const Bridge& bridge, double least_probability, Stripe& stripe) {
  const std::size_t i = element_of(bridge);
  stripe.across_px[i] = bridge.across_px;
  stripe.sigma_px[i] = static_cast<float>(bridge.sigma_px);
  stripe.amplitude_dn[i] = static_cast<float>(bridge.amplitude_dn);
  stripe.width_px[i] = static_cast<float>(bridge.width_px);
  stripe.confidence[i] = bridge.probability;
  const bool is_ok = static_cast<double>(bridge.probability) >= least_probability;
  stripe.status[i] = is_ok ? ReturnStatus::kOk : ReturnStatus::kOutlier;
}

void BridgedGaps::find_sure(const Stripe& stripe) {
  const AxisGrid& across = grid_across(stripe.grid, stripe.axis);
  sure_.clear();
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (!is_sure(stripe, i)) continue;
    const double sigma = static_cast<double>(stripe.sigma_px[i]) / across.step;
    const bool is_bridged = has(stripe.line[i]);
    sure_.add({stripe.line[i], across.index(stripe.across_px[i]),
               std::hypot(sigma, is_bridged ? kLeastBridgedSigma_px : kLeastSigma_px),
               static_cast<double>(stripe.amplitude_dn[i]), log_odds_of(stripe, i, kMostLogOdds),
               is_bridged});
  }
}

void BridgedGaps::look_at_frame(const Measured& frame, const Stripe& stripe) {
  float sure = 0.0F;
  float doubtful = 0.0F;
  float log_odds = 0.0F;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (is_sure(stripe, i)) {
      sure += 1.0F;
      log_odds += log_odds_of(stripe, i, kMostLogOdds);
    } else if (std::isfinite(stripe.across_px[i])) {
      doubtful += 1.0F;
    }
  }
  const auto lines = static_cast<float>(std::max<std::size_t>(1, stripe.size()));
  of_frame_.of[BridgeEvidence::kSurePart] = sure / lines;
  of_frame_.of[BridgeEvidence::kDoubtfulPart] = doubtful / lines;
  of_frame_.of[BridgeEvidence::kFrameOdds] = log_odds / std::max(1.0F, sure);
  of_frame_.of[BridgeEvidence::kCoverage] = frame.coverage;
  of_frame_.of[BridgeEvidence::kClutter] = frame.clutter;
}

std::optional<BridgedGaps::Fitted> BridgedGaps::fit(const Measured& frame, double width,
                                                    const ExpectedPlace& expected) {
  const FrameAtHand& at_hand = frame.at_hand;
  const EdgeProfile profile = edge_profile_at(at_hand.frame, at_hand.axis, expected.line,
                                              expected.position, with_pixel_box(width));
  const PlanNoise& noise = at_hand.noise;
  EdgePrior prior = edge_prior(at_hand.frame, noise, profile, expected.position,
                               kPartOfAmplitude * expected.amplitude_dn, width);
  prior.sigma[EdgeModel::kPosition] = std::hypot(expected.sigma, kFree_px);
  std::array<EdgeModel, kStarts> starts;
  std::size_t count = 0;
  for (const Steep& steep : steepest_of(profile)) {
    if (steep.slope == 0.0) continue;
    EdgeModel& start = starts[count++] = prior.mean;
    start.of[EdgeModel::kEdge] = steep.at;
    start.of[EdgeModel::kContrast] = std::copysign(kSeenContrast, steep.slope);
  }
  if (count == 0) return std::nullopt;
  const std::span<const EdgeModel> begun{starts.data(), count};
  const auto off_line_px = [&](const EdgeEstimate& fitted) {
    return std::abs(fitted.model.of[EdgeModel::kPosition] - expected.position);
  };
  EdgeEstimate best = fit_edge_from(begun, profile, noise, prior, kFirstSteps, kMostSteps);
  const double free_off_px = off_line_px(best);
  prior.sigma[EdgeModel::kPosition] = std::hypot(expected.sigma, kOffLine_px);
  best = free_off_px < kMostOffLine_px
             ? fit_edge(profile, noise, prior, best.model, EdgeKind::kReflectance, kMostSteps)
             : fit_edge_from(begun, profile, noise, prior, kFirstSteps, kMostSteps);
  const bool is_there = best.variance > 0.0 && best.variance < kMostSigma_px * kMostSigma_px &&
                        best.core_misfit < kMostMisfit && best.misfit < kMostMisfitOfAll &&
                        off_line_px(best) < kMostOffLine_px &&
                        height_of(best.model) < kMostHeights * expected.most_amplitude_dn &&
                        is_high(frame, best.model) && is_whole(profile, best.model);
  if (!is_there) return std::nullopt;
  const double gain = gain_of(profile, noise, prior, best);
  if (!(gain >= std::max(kLeastGain, kLeastGainOverMisfit * best.misfit))) return std::nullopt;
  return Fitted{best, gain, free_off_px};
}

// How well it fits, and what.
void BridgedGaps::add_fit(const Fitted& fitted, double width, BridgeEvidence& e) {
  const EdgeEstimate& found = fitted.estimate;
  const EdgeModel& model = found.model;
  const double contrast = std::abs(model.of[EdgeModel::kContrast]);
  const double away = std::abs(model.of[EdgeModel::kEdge] - model.of[EdgeModel::kPosition]);
  const double bright_dn = model.of[EdgeModel::kAmbient] * (1.0 + contrast);
  e.of[BridgeEvidence::kGain] = log2_of(1.0 + fitted.gain);
  e.of[BridgeEvidence::kCoreMisfit] = log2_of(found.core_misfit);
  e.of[BridgeEvidence::kMisfit] = log2_of(found.misfit);
  e.of[BridgeEvidence::kContrast] = static_cast<float>(contrast);
  e.of[BridgeEvidence::kEdgeAway] = at_most(kFarthest, away / width);
  e.of[BridgeEvidence::kSigma] = log2_of(std::sqrt(found.variance));
  e.of[BridgeEvidence::kBright] = log2_ratio(bright_dn, height_of(model));
  e.of[BridgeEvidence::kWidth] = log2_of(width);
}

// What the scan line had by itself.
void BridgedGaps::add_own(const Bridge& bridge, const Stripe& stripe, BridgeEvidence& e) {
  const std::size_t i = element_of(bridge);
  e.of[BridgeEvidence::kOwnAway] = e.of[BridgeEvidence::kOwnOff] = static_cast<float>(kFarthest);
  if (!std::isfinite(stripe.across_px[i])) return;
  const double step = grid_across(stripe.grid, stripe.axis).step;
  const double away = std::abs(stripe.across_px[i] - bridge.across_px);
  const double sigma = std::hypot(static_cast<double>(stripe.sigma_px[i]), bridge.sigma_px);
  e.of[BridgeEvidence::kHasOwn] = 1.0F;
  e.of[BridgeEvidence::kOwnOdds] = log_odds_of(stripe, i, kMostOdds);
  e.of[BridgeEvidence::kOwnAway] = at_most(kFarthest, away / step);
  e.of[BridgeEvidence::kOwnOff] = at_most(kFarthest, away / sigma);
  e.of[BridgeEvidence::kIsOwnWide] = stripe.status[i] == ReturnStatus::kWide ? 1.0F : 0.0F;
  e.of[BridgeEvidence::kIsOwnNarrow] = stripe.status[i] == ReturnStatus::kNarrow ? 1.0F : 0.0F;
}

// How the few on either side of it lie and fit that were measured so, too.
void BridgedGaps::add_beside(std::size_t k) {
  Bridge& bridge = bridges_[k];
  BridgeEvidence& e = bridge.evidence;
  double count = 0.0;
  double off_px = 0.0;
  float gain = 0.0F;
  float misfit = 0.0F;
  const auto add = [&](const Bridge& other) {
    if (std::abs(other.line - bridge.line) > kBesideLines) return false;
    count += 1.0;
    off_px += other.off_px;
    gain += other.evidence.of[BridgeEvidence::kGain];
    misfit += other.evidence.of[BridgeEvidence::kCoreMisfit];
    return true;
  };
  for (std::size_t other = k; other-- > 0 && add(bridges_[other]);) {
  }
  for (std::size_t other = k + 1; other < bridges_.size() && add(bridges_[other]); ++other) {
  }
  const auto of_one = static_cast<float>(1.0 / std::max(1.0, count));
  e.of[BridgeEvidence::kBeside] = static_cast<float>(count);
  e.of[BridgeEvidence::kBesideOff] =
      count > 0.0 ? at_most(kFarthest, std::abs(off_px / count - bridge.off_px)) : 0.0F;
  e.of[BridgeEvidence::kBesideGain] = of_one * gain;
  e.of[BridgeEvidence::kBesideMisfit] = of_one * misfit;
}

}  // namespace striper::detail
