// SPDX-License-Identifier: Apache-2.0
#include "stripe/profile_extractor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

// Half of each is measured well enough to know it by.
constexpr std::array kTriedWidths{0.8, 1.5, 3.0, 6.0};

constexpr int kMostPasses = 4;
constexpr double kWidthSettled = 0.04;

}  // namespace

void ProfileExtractor::extract(const LitFrame& frame, Stripe& stripe) {
  stripe.axis = options_.axis;
  const LitFrame searched = part_.cut(frame, options_.axis, expected_of(options_, frame.laser));
  stripe.grid = searched.grid;
  extract_searched({frame, searched}, stripe);
  stripe.grid = frame.grid;
}

void ProfileExtractor::extract_searched(const Frames& frames, Stripe& stripe) {
  const LitFrame& frame = frames.searched;
  const int lines = line_count(frame.lit, options_.axis);
  bridges_.begin(static_cast<std::size_t>(lines));
  if (line_length(frame.lit, options_.axis) < kLeastLength) return stripe.reset(lines);
  stripe.resize(lines);

  finder_.begin(frame);
  const FrameAtHand current = at_hand(frame);
  WidthTracker& learnt = widths_.of(current, finder_.blocks(), options_);
  find_and_choose(current, learnt);
  const StripeReport::Choice chosen{current, options_, finder_, choice_, learnt.model()};
  report_.write(chosen, stripe);

  const std::optional<WidthModel> known = known_width(frame, options_);
  const WidthModel& width = known ? *known : learnt.model();
  errors_.add(current, {width, known.has_value()}, choice_, options_, stripe);
  rate_returns(chosen, frames.whole, stripe);
  bridge_gaps(current, width, stripe);
  if (options_.can_explain) keep_for_explanation(frame, current.noise, width, stripe);
}

void ProfileExtractor::rate_returns(const StripeReport::Choice& chosen, const LitFrame& whole,
                                    Stripe& stripe) {
  const auto lines = static_cast<std::size_t>(finder_.blocks().lines());
  evidence_.begin(lines);
  confidence_.begin(lines);
  if (!StripeReport::is_rated(choice_, options_)) return;
  const ReturnEvidence::Measured measured{choice_, errors_.edges()};
  evidence_.look_at(measured, stripe);
  confidence_.rate_alone(evidence_, measured, stripe);
  clipped_errors_.widen(evidence_, measured, confidence_, stripe);
  confidence_.rate_among_others(evidence_, measured, stripe);
  if (is_look_known(whole.laser)) confidence_.rate_by_image(evidence_, measured, whole, stripe);
  report_.settle(chosen, confidence_, stripe);
}

// Whether a model tells what the stripe is like: the network has learnt of frames where it does.
bool ProfileExtractor::is_look_known(int laser) const {
  const ExpectedStripe* const expected = expected_of(options_, laser);
  if (expected == nullptr || !expected->sigma_px) return false;
  return std::any_of(expected->amplitude_dn.begin(), expected->amplitude_dn.end(),
                     [](float height_dn) { return height_dn > 0.0F; });
}

Evidence ProfileExtractor::evidence(const Stripe& stripe, int line) const noexcept {
  const auto at = static_cast<std::size_t>(line);
  Evidence e = evidence_.of({choice_, errors_.edges()}, stripe, at);
  confidence_.neighbours().add_to(e, at);
  return e;
}

FrameAtHand ProfileExtractor::at_hand(const LitFrame& frame) {
  const ProfileImages images = images_of(frame, options_.axis);
  const PlanNoise noise = noise_.of(frame, images, finder_.blocks().best_across(), options_);
  const double step = grid_across(frame.grid, options_.axis).step;
  return {frame, options_.axis, images, noise, noise_dn_of(noise), step, part_.ignored()};
}

// Where the width, or the filter that fits it, turns out to be another than was thought, once more
// with that.
void ProfileExtractor::find_and_choose(const FrameAtHand& at_hand, WidthTracker& width) {
  if (!options_.stripe_sigma_px && !width.is_trusted()) try_widths(at_hand, width);
  const bool refine = options_.method == ExtractMethod::kRefined;
  for (int pass = 1; pass <= kMostPasses; ++pass) {
    const double filter = filter_sigma(width.model(), at_hand.noise, refine);
    finder_.find(at_hand, part_, width.model());
    choose(at_hand, width);
    if (is_more_than_peaks(at_hand.frame)) {
      finder_.find_ridges(at_hand, part_, width.model());
      choose(at_hand, width);
    }
    if (options_.stripe_sigma_px) return;
    const double change = widths_.learn(at_hand, choice_, width);
    const double filter_change = filter_sigma(width.model(), at_hand.noise, refine) / filter;
    const double largest = std::max(std::abs(change - 1.0), std::abs(filter_change - 1.0));
    if (largest < kWidthSettled) return;
  }
}

// Of a first frame whose background hides the stripe: begins with the width by which most of the
// scan lines show one.
void ProfileExtractor::try_widths(const FrameAtHand& at_hand, WidthTracker& width) {
  finder_.find(at_hand, part_, width.model());
  if (!finder_.is_hidden()) return;
  float best = 0.0F;
  double taken = width.model().at_pivot;
  for (const double tried : kTriedWidths) {
    width.set(tried);
    finder_.find(at_hand, part_, width.model());
    choice_.survey(finder_.candidates(), context_of(at_hand, width), threshold());
    const float merit = choice_.merit();
    if (!(merit > best)) continue;
    best = merit;
    taken = choice_.width().at_pivot;
  }
  width.set(taken);
}

// Whether the frame is not so plain that the highest peak of a scan line were the stripe.
bool ProfileExtractor::is_more_than_peaks(const LitFrame& frame) const {
  return !finder_.is_hidden() && !is_background_subtracted(frame) &&
         !options_.each_line_by_itself && !choice_.is_plain();
}

void ProfileExtractor::bridge_gaps(const FrameAtHand& at_hand, const WidthModel& width,
                                   Stripe& stripe) {
  if (!StripeReport::is_rated(choice_, options_)) return;
  const BridgedGaps::Measured measured{at_hand,
                                       part_,
                                       width,
                                       errors_.excess_sigma_px(at_hand, options_),
                                       options_.threshold_dn.value_or(0.0),
                                       options_.min_snr,
                                       options_.min_confidence,
                                       choice_.coverage(),
                                       choice_.clutter()};
  bridges_.measure(measured, stripe);
}

ChoiceContext ProfileExtractor::context_of(const FrameAtHand& at_hand,
                                           const WidthTracker& width) const {
  return {.width = width.model(),
          .is_width_known = options_.stripe_sigma_px || width.is_trusted(),
          .is_by_itself = options_.each_line_by_itself,
          .is_hidden = finder_.is_hidden(),
          .is_subtracted = is_background_subtracted(at_hand.frame),
          .black_dn = static_cast<float>(at_hand.noise.model.black_level_dn),
          .frame = &at_hand.frame,
          .axis = options_.axis,
          .expected = expected_of(options_, at_hand.frame.laser)};
}

float ProfileExtractor::threshold() const {
  return static_cast<float>(finder_.detection().threshold());
}

void ProfileExtractor::choose(const FrameAtHand& at_hand, const WidthTracker& width) {
  choice_.choose(finder_.candidates(), context_of(at_hand, width), threshold());
}

}  // namespace striper::detail
