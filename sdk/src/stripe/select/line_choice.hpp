// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include <striper/stripe/extractor.hpp>

#include "stripe/candidates/block_maxima.hpp"
#include "stripe/candidates/peak_candidates.hpp"
#include "stripe/profile/profile_plan.hpp"
#include "stripe/select/stripe_choice.hpp"

namespace striper::detail {

/// One of the peaks of a scan line.
struct LinePeak {
  const PeakList* list;
  std::size_t at;
  double position;  // Across, pixels of the image.

  ReturnStatus status() const noexcept { return list->status[at]; }
  float amplitude() const noexcept { return list->amplitude[at]; }
};

/// The peaks of a scan line in order across; candidates that turned out to be the same peak are
/// one.
struct LinePeaks {
  std::array<LinePeak, Ridges::kMost + 1> peaks;
  std::size_t count = 0;

  const LinePeak* begin() const noexcept { return peaks.data(); }
  const LinePeak* end() const noexcept { return peaks.data() + count; }
};

/// Of judged candidates. `extra` is the scan line's first extra.
LinePeaks peaks_of_line(const PeakCandidates& candidates, int line, std::size_t extra,
                        const WidthModel& width);

/// Writes a peak to element i of a stripe.
void put_peak(const LinePeak& peak, std::size_t i, Stripe& stripe);

/// Fills `stripe`, every number of it, from judged candidates by the rule of `options`, each scan
/// line by itself: where the background hides nothing.
void choose_by_height(const PeakCandidates& candidates, const WidthModel& width,
                      const ExtractOptions& options, Stripe& stripe);

/// The same from what was chosen over the whole image.
void choose_by_evidence(const StripeChoice& choice, const ExtractOptions& options, Stripe& stripe);

/// Gives the return of a scan line, in which something was chosen and reported, another
/// probability, and the status that comes of it.
void rate_chosen(const StripeChoice& choice, std::size_t line, float probability,
                 const ExtractOptions& options, Stripe& stripe);

}  // namespace striper::detail
