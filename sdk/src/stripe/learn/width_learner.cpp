// SPDX-License-Identifier: Apache-2.0
#include "stripe/learn/width_learner.hpp"

#include "stripe/learn/clipped_width.hpp"

namespace striper::detail {
namespace {

// Widths of strong profiles are taken; where a frame has too few of them, of weak ones too.
// More probably the stripe than not.
constexpr float kLeastConfidence = 0.5F;
constexpr float kStrongSnr = 12.0F;
constexpr float kFairSnr = 4.0F;
constexpr int kEnoughStrong = 24;
constexpr std::size_t kLaterSamples = 48;  // Of a frame, once the width is known.
constexpr int kFirstClippedFits = 64;
constexpr int kClippedFits = 12;

// How many of the scan lines looked at have a peak of which kind.
struct Census {
  int strong = 0;
  int fair = 0;  // The strong ones among them.
  int clipped = 0;
};

// What was chosen in a scan line and is more probably the stripe than not; null without such.
const Candidate* stripe_of(const StripeChoice& choice, int line) {
  const StripeChoice::Chosen& chosen = choice.of_line(line);
  if (chosen.candidate < 0 || chosen.confidence < kLeastConfidence) return nullptr;
  return &choice.pieces().candidate(static_cast<std::size_t>(chosen.candidate));
}

// Takes the stripe of every so many scan lines, from scan line `first` modulo that, if it is clear
// enough.
Census add_samples(const StripeChoice& choice, float least_snr, std::size_t first,
                   WidthTracker& width) {
  width.begin();
  Census census;
  const auto lines = static_cast<std::size_t>(choice.pieces().lines());
  const std::size_t most = width.has_learnt() ? kLaterSamples : WidthTracker::kMostSamples;
  const std::size_t stride = lines / most + 1;
  for (std::size_t line = first % stride; line < lines && !width.is_full(); line += stride) {
    const Candidate* const stripe = stripe_of(choice, static_cast<int>(line));
    if (stripe == nullptr) continue;
    if (stripe->is_clipped) {
      ++census.clipped;
      continue;
    }
    census.fair += static_cast<int>(stripe->snr > kFairSnr);
    census.strong += static_cast<int>(stripe->snr > kStrongSnr);
    if (stripe->snr > least_snr) width.add(stripe->across, stripe->width, stripe->amplitude);
  }
  return census;
}

}  // namespace

double WidthLearner::learn(const LitFrame& frame, StripeAxis axis, const StripeChoice& choice,
                           WidthTracker& width) {
  ++next_line_;
  const Census census = add_samples(choice, kStrongSnr, next_line_, width);
  // A few strong peaks beside many fair ones are light sources and edges: the stripe is the many.
  if (census.strong >= kEnoughStrong && 2 * census.strong >= census.fair) return width.finish();
  if (census.clipped > census.fair && add_clipped_samples(frame, axis, choice, width) > 0) {
    return width.finish();
  }
  add_samples(choice, kFairSnr, next_line_, width);
  return width.finish();
}

int WidthLearner::add_clipped_samples(const LitFrame& frame, StripeAxis axis,
                                      const StripeChoice& choice, WidthTracker& width) {
  width.begin();
  const int most = width.has_learnt() ? kClippedFits : kFirstClippedFits;
  const auto lines = choice.pieces().lines();
  int count = 0;
  for (int n = 0; n < most; ++n) {
    // Other scan lines in every frame, spread evenly.
    next_clipped_line_ = (next_clipped_line_ + lines / most * 5 / 3 + 1) % lines;
    const Candidate* const stripe = stripe_of(choice, next_clipped_line_);
    if (stripe == nullptr || !stripe->is_clipped) continue;
    const auto position = static_cast<double>(stripe->across);
    const auto fitted = fit_clipped_width(
        frame, axis, {next_clipped_line_, position, stripe->amplitude, width.model().at(position)});
    if (!fitted) continue;
    width.add(position, *fitted, stripe->amplitude);
    ++count;
  }
  return count;
}

}  // namespace striper::detail
