// SPDX-License-Identifier: Apache-2.0
#include "stripe/width_learner.hpp"

#include "stripe/clipped_width.hpp"

namespace striper::detail {
namespace {

// Widths of strong profiles are taken; where a frame has too few of them, of weak ones too.
constexpr float kStrongSnr = 12.0F;
constexpr float kFairSnr = 4.0F;
constexpr int kEnoughStrong = 24;
constexpr std::size_t kLaterSamples = 48;  // Of a frame, once the width is known.
constexpr int kFirstClippedFits = 64;
constexpr int kClippedFits = 12;

// How many of the lines looked at have a peak of which kind.
struct Census {
  int strong = 0;
  int fair = 0;  // The strong ones among them.
  int clipped = 0;
};

// Takes the clearest peak of every so many lines, from line `first` modulo that, if it is clear
// enough.
Census add_samples(const PeakCandidates& peaks, float least_snr, std::size_t first,
                   WidthTracker& width) {
  width.begin();
  Census census;
  const std::size_t lines = peaks.firsts.size();
  const std::size_t most = width.has_learnt() ? kLaterSamples : WidthTracker::kMostSamples;
  const std::size_t stride = lines / most + 1;
  std::size_t extra = 0;
  for (std::size_t line = first % stride; line < lines && !width.is_full(); line += stride) {
    const PeakList* list = &peaks.firsts;
    std::size_t best = line;
    while (extra < peaks.extras.size()) {
      const auto of_line = static_cast<std::size_t>(peaks.extras.seeds[extra].line);
      if (of_line > line) break;
      if (of_line == line && peaks.extras.amplitude[extra] > list->amplitude[best]) {
        list = &peaks.extras;
        best = extra;
      }
      ++extra;
    }
    const float snr = list->snr[best];
    if (list->clipped[best] > 0.0F) {
      ++census.clipped;
      continue;
    }
    census.fair += static_cast<int>(snr > kFairSnr);
    census.strong += static_cast<int>(snr > kStrongSnr);
    if (snr > least_snr) width.add(list->across[best], list->width[best], list->amplitude[best]);
  }
  return census;
}

}  // namespace

double WidthLearner::learn(const LitFrame& frame, StripeAxis axis, const PeakCandidates& peaks,
                           WidthTracker& width) {
  ++next_line_;
  const Census census = add_samples(peaks, kStrongSnr, next_line_, width);
  // A few strong peaks beside many fair ones are lamps and edges: the stripe is the many.
  if (census.strong >= kEnoughStrong && 2 * census.strong >= census.fair) return width.finish();
  if (census.clipped > census.fair && add_clipped_samples(frame, axis, peaks.firsts, width) > 0) {
    return width.finish();
  }
  add_samples(peaks, kFairSnr, next_line_, width);
  return width.finish();
}

int WidthLearner::add_clipped_samples(const LitFrame& frame, StripeAxis axis,
                                      const PeakList& firsts, WidthTracker& width) {
  width.begin();
  const int most = width.has_learnt() ? kClippedFits : kFirstClippedFits;
  const auto lines = static_cast<int>(firsts.size());
  int count = 0;
  for (int n = 0; n < most; ++n) {
    // Other lines in every frame, spread evenly.
    next_clipped_line_ = (next_clipped_line_ + lines / most * 5 / 3 + 1) % lines;
    const auto i = static_cast<std::size_t>(next_clipped_line_);
    if (!(firsts.clipped[i] > 0.0F)) continue;
    const double position = firsts.position(i);
    const auto fitted = fit_clipped_width(
        frame, axis,
        {next_clipped_line_, position, firsts.amplitude[i], width.model().at(position)});
    if (!fitted) continue;
    width.add(position, *fitted, firsts.amplitude[i]);
    ++count;
  }
  return count;
}

}  // namespace striper::detail
