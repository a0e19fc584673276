// SPDX-License-Identifier: Apache-2.0
#include "stripe/report/stripe_report.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "stripe/profile/line_view.hpp"
#include "stripe/profile/profile_plan.hpp"
#include "stripe/select/forests/choice_trees.hpp"
#include "stripe/select/line_choice.hpp"
#include "stripe/select/peak_judge.hpp"

namespace striper::detail {
namespace {

// So many of the scan lines certainly have the stripe where one is in view: seven of 640. What was
// rated among others is certain with .999: two of 600 rooms without a laser (seeds from 96000) had
// 13 and 27 scan lines of .99, of boards seen edge-on. None had more than one of .999.
constexpr double kLeastCertain = 0.01;
constexpr float kCertain = 0.999F;

// What is told by its neighbours has so many of them at least; and alone it is as likely a specular
// highlight.
constexpr int kFewestToCompare = 16;
constexpr float kOfOneAlone = 0.5F;
constexpr double kSamePeakPx = 0.5;

using Choice = StripeReport::Choice;

// Whether at least half of what is good is clear in its own scan line.
bool is_mostly_clear(const Choice& chosen, const Stripe& stripe) {
  const auto& significance = chosen.finder.candidates().primary.significance;
  std::size_t good = 0;
  std::size_t clear = 0;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (stripe.status[i] != ReturnStatus::kOk) continue;
    ++good;
    const auto line = static_cast<std::size_t>(stripe.line[i]);
    clear += static_cast<std::size_t>(significance[line] >= kClearSignificance);
  }
  return 2 * clear >= good;
}

// Whether the piece of what was chosen is that one candidate.
bool is_alone(const StripePieces& pieces, int line, double across) {
  for (std::size_t n = pieces.first_of(line); n < pieces.first_of(line + 1); ++n) {
    const auto at = static_cast<double>(pieces.candidate(n).across);
    if (!(std::abs(at - across) < kSamePeakPx)) continue;
    if (pieces.pieces()[static_cast<std::size_t>(pieces.link(n).piece)].count == 1) return true;
  }
  return false;
}

// A stripe would show in a scan line beside it, or not far off, where most of it is clear.
void mark_alone(const Choice& chosen, Stripe& stripe) {
  const bool is_comparable =
      chosen.options.peak != PeakRule::kAll && chosen.finder.blocks().lines() >= kFewestToCompare;
  if (!is_comparable || !is_mostly_clear(chosen, stripe)) return;
  const AxisGrid& across = grid_across(stripe.grid, stripe.axis);
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (stripe.status[i] != ReturnStatus::kOk) continue;
    const double at = across.index(stripe.across_px[i]);
    if (!is_alone(chosen.choice.pieces(), stripe.line[i], at)) continue;
    stripe.status[i] = ReturnStatus::kOutlier;
    stripe.confidence[i] = std::min(stripe.confidence[i], kOfOneAlone);
  }
}

bool is_any_good(const Stripe& stripe) {
  return std::any_of(stripe.status.begin(), stripe.status.end(),
                     [](ReturnStatus s) { return s == ReturnStatus::kOk; });
}

// What is good is the stripe with the probability that was asked for. And where fewer scan lines
// certainly have it than a stripe that is in view gives, the image has none.
void mark_outliers(const Choice& chosen, double min_confidence, float certain, Stripe& stripe) {
  stripe.is_seen = is_any_good(stripe);
  if (chosen.options.each_line_by_itself) return;
  const auto least = static_cast<float>(min_confidence);
  std::size_t good = 0;
  std::size_t certain_returns = 0;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (stripe.status[i] != ReturnStatus::kOk) continue;
    if (stripe.confidence[i] < least) stripe.status[i] = ReturnStatus::kOutlier;
    good += static_cast<std::size_t>(stripe.status[i] == ReturnStatus::kOk);
    certain_returns += static_cast<std::size_t>(stripe.confidence[i] >= certain);
  }
  const double least_certain =
      chosen.choice.is_plain() ? 0.0 : kLeastCertain * chosen.finder.blocks().lines();
  // A faint stripe that is tracked goes on where no scan line alone shows it.
  const bool is_followed = chosen.options.peak == PeakRule::kContinuous;
  const bool is_scattered = chosen.choice.is_scattered() && !is_followed;
  stripe.is_seen =
      good > 0 && static_cast<double>(certain_returns) >= least_certain && !is_scattered;
  if (stripe.is_seen) return;
  for (ReturnStatus& status : stripe.status) {
    if (status == ReturnStatus::kOk) status = ReturnStatus::kOutlier;
  }
}

// Where two images are subtracted, the mask has what is clipped in both.
void mark_masked_lines(const LitFrame& frame, const BlockMaxima& blocks, Stripe& stripe) {
  const auto is_clipped = [&](int line) {
    return frame.dark.empty() && blocks.brightest_dn(line) >= frame.full_scale_dn;
  };
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (stripe.status[i] != ReturnStatus::kNoStripe) continue;
    const int line = stripe.line[i];
    if (blocks.is_partly_masked(line) || is_clipped(line)) stripe.status[i] = ReturnStatus::kBlind;
  }
}

}  // namespace

bool StripeReport::is_rated(const StripeChoice& choice, const ExtractOptions& options) noexcept {
  const bool is_whichever =
      options.peak == PeakRule::kBrightest || options.peak == PeakRule::kContinuous;
  return is_whichever && !choice.is_plain();
}

void StripeReport::write(const Choice& chosen, Stripe& stripe) {
  put_chosen(chosen, stripe);
  const LitFrame& frame = chosen.at_hand.frame;
  const bool has_background =
      !is_background_subtracted(frame) && !chosen.options.each_line_by_itself;
  if (chosen.choice.is_plain() && has_background) mark_alone(chosen, stripe);
  // What is rated once more is measured alike whatever is asked of it then.
  const bool is_final = !is_rated(chosen.choice, chosen.options);
  mark_outliers(chosen, is_final ? chosen.options.min_confidence : double{kSure}, kSure, stripe);
  mark_masked_lines(frame, chosen.finder.blocks(), stripe);
}

void StripeReport::settle(const Choice& chosen, const ReturnConfidence& confidence,
                          Stripe& stripe) const {
  for (std::size_t line = 0; line < stripe.size(); ++line) {
    const std::optional<float> probability = confidence.of_line(line);
    if (probability) rate_chosen(chosen.choice, line, *probability, chosen.options, stripe);
  }
  mark_outliers(chosen, chosen.options.min_confidence, kCertain, stripe);
}

void StripeReport::put_chosen(const Choice& chosen, Stripe& stripe) {
  const auto& [at_hand, options, finder, choice, width] = chosen;
  const PeakLimits limits =
      limits_of(options, finder.detection(), width, at_hand.images.length, at_hand.step);
  PeakCandidates& candidates = finder.candidates();
  judge_peaks(limits, candidates.primary);
  judge_peaks(limits, candidates.secondary);
  if (!choice.is_plain()) return choose_by_evidence(choice, options, stripe);
  choose_by_height(candidates, width, options, stripe);
  if (options.peak != PeakRule::kContinuous) return;
  const ProfilePlan plan = plan_profile(width, at_hand.noise, false, BackgroundReach::kWide);
  follower_.follow(at_hand, candidates, width, plan, limits, stripe);
  // Where nothing is subtracted the chain finds what else there is, unless hardly a scan line
  // tells.
  const bool is_doubted =
      !is_background_subtracted(at_hand.frame) && is_mostly_clear(chosen, stripe);
  follower_.drop_unsupported(finder.blocks(), is_doubted, stripe);
}

}  // namespace striper::detail
