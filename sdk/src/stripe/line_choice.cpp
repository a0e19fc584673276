// SPDX-License-Identifier: Apache-2.0
#include "stripe/line_choice.hpp"

#include <algorithm>
#include <cmath>

#include "stripe/line_view.hpp"

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
  // Half at equal heights, 0.94 at half the height.
  stripe.confidence[line] *= 1.0F / (1.0F + ratio * ratio * ratio * ratio);
  const bool is_ambiguous = ratio >= static_cast<float>(options.ambiguity_ratio);
  if (is_ambiguous && chosen->status() == ReturnStatus::kOk) {
    stripe.status[line] = ReturnStatus::kAmbiguous;
  }
}

void put_firsts(const PeakList& firsts, Stripe& stripe) {
  const std::size_t count = firsts.size();
  const AxisGrid& across = grid_across(stripe.grid, stripe.axis);
  for (std::size_t i = 0; i < count; ++i) stripe.across_px[i] = across.sensor(firsts.position(i));
  std::copy_n(firsts.sigma.begin(), count, stripe.sigma_px.begin());
  std::copy_n(firsts.amplitude.begin(), count, stripe.amplitude_dn.begin());
  std::copy_n(firsts.width.begin(), count, stripe.width_px.begin());
  std::copy_n(firsts.confidence.begin(), count, stripe.confidence.begin());
  std::copy_n(firsts.status.begin(), count, stripe.status.begin());
}

void put_all(const PeakCandidates& candidates, const WidthModel& width, Stripe& stripe) {
  stripe.clear();
  stripe.reserve(candidates.firsts.size() * ChunkMaxima::kBest);
  for (int line = 0; line < static_cast<int>(candidates.firsts.size()); ++line) {
    const LinePeaks peaks = peaks_of_line(candidates, line, candidates.first_extra(line), width);
    if (peaks.count == 0) stripe.append(line);
    for (const LinePeak& peak : peaks) put_peak(peak, stripe.append(line), stripe);
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
  consider(candidates.firsts, static_cast<std::size_t>(line));
  const std::vector<PeakSeed>& seeds = candidates.extras.seeds;
  for (; extra < seeds.size() && seeds[extra].line == line; ++extra) {
    consider(candidates.extras, extra);
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

void choose_peaks(const PeakCandidates& candidates, const WidthModel& width,
                  const ExtractOptions& options, Stripe& stripe) {
  if (options.peak == PeakRule::kAll) {
    put_all(candidates, width, stripe);
    return;
  }
  put_firsts(candidates.firsts, stripe);
  const std::vector<PeakSeed>& extras = candidates.extras.seeds;
  for (std::size_t i = 0; i < extras.size();) {
    const int line = extras[i].line;
    const LinePeaks peaks = peaks_of_line(candidates, line, i, width);
    if (peaks.count > 0) {
      choose_in_line(peaks, static_cast<std::size_t>(line), options, stripe);
    }
    while (i < extras.size() && extras[i].line == line) ++i;
  }
}

}  // namespace striper::detail
