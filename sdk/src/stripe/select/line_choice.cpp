// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/line_choice.hpp"

#include <algorithm>
#include <cmath>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

// Two candidates nearer than this, in widths, are one peak.
constexpr double kSamePeak = 1.0;

void insert(const LinePeak& peak, double near, LinePeaks& peaks) {
  const bool is_known = std::any_of(peaks.begin(), peaks.end(), [&](const LinePeak& other) {
    return std::abs(other.position - peak.position) < near;
  });
  if (is_known) return;
  std::size_t at = peaks.count++;
  for (; at > 0 && peaks.peaks[at - 1].position > peak.position; --at) {
    peaks.peaks[at] = peaks.peaks[at - 1];
  }
  peaks.peaks[at] = peak;
}

// ---- Where each scan line can tell by itself.

// A good peak goes before a doubtful one; among equals the rule decides.
bool is_preferred(const LinePeak& peak, const LinePeak& to, const ExtractOptions& options) {
  const bool is_good = peak.status() == ReturnStatus::kOk;
  if (is_good != (to.status() == ReturnStatus::kOk)) return is_good;
  switch (options.peak) {
    case PeakRule::kNearest:
      return (options.near_end == NearEnd::kFirstPixel) == (peak.position < to.position);
    case PeakRule::kFarthest:
      return (options.near_end == NearEnd::kFirstPixel) != (peak.position < to.position);
    case PeakRule::kBrightest:
    case PeakRule::kContinuous:
    case PeakRule::kAll:
      break;
  }
  return peak.amplitude() > to.amplitude();
}

// How high the highest other peak of the same verdict is, as a fraction of the chosen one.
float rival_of(const LinePeak* chosen, const LinePeaks& peaks) {
  float rival = 0.0F;
  for (const LinePeak& peak : peaks) {
    const bool is_rival = &peak != chosen && peak.status() == chosen->status();
    if (is_rival) rival = std::max(rival, peak.amplitude());
  }
  return std::min(1.0F, rival / chosen->amplitude());
}

void choose_in_line(const LinePeaks& peaks, std::size_t line, const ExtractOptions& options,
                    Stripe& stripe) {
  const LinePeak* chosen = peaks.begin();
  for (const LinePeak& peak : peaks) {
    if (is_preferred(peak, *chosen, options)) chosen = &peak;
  }
  put_peak(*chosen, line, stripe);
  const bool by_height =
      options.peak == PeakRule::kBrightest || options.peak == PeakRule::kContinuous;
  if (!by_height || peaks.count == 1) return;
  const float ratio = rival_of(chosen, peaks);
  // Half at equal heights, .996 at half the height.
  const float fourth = ratio * ratio * ratio * ratio;
  stripe.confidence[line] *= 1.0F / (1.0F + fourth * fourth);
  const bool is_ambiguous = ratio >= static_cast<float>(options.ambiguity_ratio);
  if (is_ambiguous && chosen->status() == ReturnStatus::kOk) {
    stripe.status[line] = ReturnStatus::kAmbiguous;
  }
}

void put_primary(const PeakList& primary, Stripe& stripe) {
  const std::size_t count = primary.size();
  const AxisGrid& across = grid_across(stripe.grid, stripe.axis);
  for (std::size_t i = 0; i < count; ++i) stripe.across_px[i] = across.sensor(primary.position(i));
  std::copy_n(primary.sigma.begin(), count, stripe.sigma_px.begin());
  std::copy_n(primary.amplitude.begin(), count, stripe.amplitude_dn.begin());
  std::copy_n(primary.width.begin(), count, stripe.width_px.begin());
  std::copy_n(primary.confidence.begin(), count, stripe.confidence.begin());
  std::copy_n(primary.status.begin(), count, stripe.status.begin());
}

void put_all_by_height(const PeakCandidates& candidates, const WidthModel& width, Stripe& stripe) {
  stripe.clear();
  stripe.reserve(candidates.primary.size() * (Ridges::kMost + 1));
  for (int line = 0; line < static_cast<int>(candidates.primary.size()); ++line) {
    const LinePeaks peaks =
        peaks_of_line(candidates, line, candidates.first_secondary(line), width);
    if (peaks.count == 0) stripe.append(line);
    for (const LinePeak& peak : peaks) put_peak(peak, stripe.append(line), stripe);
  }
}

// ---- Where the whole image decides.

// A rival at least so probable makes the scan line's return ambiguous rather than an outlier.
constexpr float kLikelyRival = 0.1F;
// Without its rivals: the rules nearest, farthest and all look at what may be the stripe by itself.
constexpr float kLeastOfAll = 0.5F;

float confidence_of(const StripeChoice& choice, std::size_t candidate) {
  return 1.0F / (1.0F + std::exp(-choice.log_odds(candidate)));
}

LinePeak peak_of(const Candidate& candidate) {
  return {candidate.list, candidate.at, static_cast<double>(candidate.across)};
}

bool is_by_place(const ExtractOptions& options) {
  return options.peak == PeakRule::kNearest || options.peak == PeakRule::kFarthest;
}

// Which of a scan line's candidates the rule takes; -1: none that can be the stripe.
std::int32_t candidate_of(const StripeChoice& choice, int line, const ExtractOptions& options) {
  const std::int32_t best = choice.of_line(line).candidate;
  if (!is_by_place(options)) return best;
  const bool from_first =
      (options.peak == PeakRule::kNearest) == (options.near_end == NearEnd::kFirstPixel);
  const StripePieces& pieces = choice.pieces();
  std::int32_t taken = -1;
  for (std::size_t i = pieces.first_of(line); i < pieces.first_of(line + 1); ++i) {
    const Candidate& c = pieces.candidate(i);
    const bool is_good = c.list->status[c.at] == ReturnStatus::kOk;
    if (!is_good || confidence_of(choice, i) < kLeastOfAll) continue;
    const bool is_before =
        taken < 0 || c.across < pieces.candidate(static_cast<std::size_t>(taken)).across;
    if (is_before == from_first || taken < 0) taken = static_cast<std::int32_t>(i);
  }
  return taken >= 0 ? taken : best;
}

// Whether two peaks of a scan line are about as high, and both good.
bool is_about_as_high(const Candidate& chosen, const Candidate& rival, double ratio) {
  return rival.list->status[rival.at] == chosen.list->status[chosen.at] &&
         static_cast<double>(rival.amplitude) >= ratio * static_cast<double>(chosen.amplitude);
}

void put_probability(const StripeChoice& choice, const Candidate& candidate, float probability,
                     const ExtractOptions& options, std::size_t i, Stripe& stripe) {
  stripe.confidence[i] = std::min(candidate.list->confidence[candidate.at], probability);
  stripe.status[i] = candidate.list->status[candidate.at];
  // Its width was weighed with the rest: beside texture it is another than the stripe's.
  const bool is_other_width =
      stripe.status[i] == ReturnStatus::kWide || stripe.status[i] == ReturnStatus::kNarrow;
  if (is_other_width && static_cast<double>(probability) >= options.min_confidence) {
    stripe.status[i] = ReturnStatus::kOk;
  }
  if (stripe.status[i] != ReturnStatus::kOk || is_by_place(options)) return;
  const StripeChoice::Chosen& chosen = choice.of_line(candidate.line);
  const float rival_probability = std::min(chosen.rival, 1.0F - probability);
  if (chosen.rival_candidate < 0 || rival_probability < kLikelyRival) return;
  const Candidate& rival =
      choice.pieces().candidate(static_cast<std::size_t>(chosen.rival_candidate));
  if (is_about_as_high(candidate, rival, options.ambiguity_ratio)) {
    stripe.status[i] = ReturnStatus::kAmbiguous;
  }
}

void put_chosen(const StripeChoice& choice, int line, const ExtractOptions& options,
                Stripe& stripe) {
  const auto i = static_cast<std::size_t>(line);
  const std::int32_t taken = candidate_of(choice, line, options);
  if (taken < 0) {
    stripe.drop(i, ReturnStatus::kNoStripe);
    return;
  }
  const auto at = static_cast<std::size_t>(taken);
  const Candidate& candidate = choice.pieces().candidate(at);
  if (candidate.list->status[candidate.at] == ReturnStatus::kNoStripe) {
    stripe.drop(i, ReturnStatus::kNoStripe);
    return;
  }
  put_peak(peak_of(candidate), i, stripe);
  const auto scatter =
      static_cast<float>(grid_across(stripe.grid, stripe.axis).step) * choice.scatter_px(at);
  stripe.sigma_px[i] = std::hypot(stripe.sigma_px[i], scatter);
  const float probability =
      is_by_place(options) ? confidence_of(choice, at) : choice.of_line(line).confidence;
  put_probability(choice, candidate, probability, options, i, stripe);
}

// The candidates of a scan line that are anything, in order across.
class InOrder {
 public:
  InOrder(const StripePieces& pieces, int line) {
    for (std::size_t i = pieces.first_of(line); i < pieces.first_of(line + 1); ++i) {
      const Candidate& c = pieces.candidate(i);
      if (c.list->status[c.at] == ReturnStatus::kNoStripe || count_ == order_.size()) continue;
      std::size_t at = count_++;
      for (; at > 0 && pieces.candidate(order_[at - 1]).across > c.across; --at) {
        order_[at] = order_[at - 1];
      }
      order_[at] = i;
    }
  }
  const std::size_t* begin() const { return order_.data(); }
  const std::size_t* end() const { return order_.data() + count_; }

 private:
  std::array<std::size_t, Ridges::kMost + 1> order_{};
  std::size_t count_ = 0;
};

void put_all_by_evidence(const StripeChoice& choice, Stripe& stripe) {
  const StripePieces& pieces = choice.pieces();
  stripe.clear();
  stripe.reserve(static_cast<std::size_t>(pieces.lines()) * (Ridges::kMost + 1));
  for (int line = 0; line < pieces.lines(); ++line) {
    const InOrder candidates(pieces, line);
    if (candidates.begin() == candidates.end()) stripe.append(line);
    for (const std::size_t candidate : candidates) {
      const std::size_t i = stripe.append(line);
      put_peak(peak_of(pieces.candidate(candidate)), i, stripe);
      stripe.confidence[i] = std::min(stripe.confidence[i], confidence_of(choice, candidate));
    }
  }
}

}  // namespace

LinePeaks peaks_of_line(const PeakCandidates& candidates, int line, std::size_t extra,
                        const WidthModel& width) {
  LinePeaks peaks;
  const auto consider = [&](const PeakList& list, std::size_t at) {
    if (list.status[at] == ReturnStatus::kNoStripe) return;
    const double position = list.position(at);
    insert({&list, at, position}, kSamePeak * width.at(position), peaks);
  };
  consider(candidates.primary, static_cast<std::size_t>(line));
  const std::vector<PeakSeed>& seeds = candidates.secondary.seeds;
  for (; extra < seeds.size() && seeds[extra].line == line; ++extra) {
    consider(candidates.secondary, extra);
  }
  return peaks;
}

void put_peak(const LinePeak& peak, std::size_t i, Stripe& stripe) {
  stripe.across_px[i] = grid_across(stripe.grid, stripe.axis).sensor(peak.position);
  stripe.sigma_px[i] = peak.list->sigma[peak.at];
  stripe.amplitude_dn[i] = peak.list->amplitude[peak.at];
  stripe.width_px[i] = peak.list->width[peak.at];
  stripe.confidence[i] = peak.list->confidence[peak.at];
  stripe.status[i] = peak.status();
}

void choose_by_height(const PeakCandidates& candidates, const WidthModel& width,
                      const ExtractOptions& options, Stripe& stripe) {
  if (options.peak == PeakRule::kAll) {
    put_all_by_height(candidates, width, stripe);
    return;
  }
  put_primary(candidates.primary, stripe);
  const std::vector<PeakSeed>& secondary = candidates.secondary.seeds;
  for (std::size_t i = 0; i < secondary.size();) {
    const int line = secondary[i].line;
    const LinePeaks peaks = peaks_of_line(candidates, line, i, width);
    if (peaks.count > 0) {
      choose_in_line(peaks, static_cast<std::size_t>(line), options, stripe);
    }
    while (i < secondary.size() && secondary[i].line == line) ++i;
  }
}

void choose_by_evidence(const StripeChoice& choice, const ExtractOptions& options, Stripe& stripe) {
  if (options.peak == PeakRule::kAll) {
    put_all_by_evidence(choice, stripe);
    return;
  }
  for (int line = 0; line < choice.pieces().lines(); ++line) {
    put_chosen(choice, line, options, stripe);
  }
}

void rate_chosen(const StripeChoice& choice, std::size_t line, float probability,
                 const ExtractOptions& options, Stripe& stripe) {
  const std::int32_t chosen = choice.of_line(static_cast<int>(line)).candidate;
  const Candidate& candidate = choice.pieces().candidate(static_cast<std::size_t>(chosen));
  put_probability(choice, candidate, probability, options, line, stripe);
}

}  // namespace striper::detail
