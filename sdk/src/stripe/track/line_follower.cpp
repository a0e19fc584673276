// SPDX-License-Identifier: Apache-2.0
#include "stripe/track/line_follower.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

#include <striper/core/robust.hpp>

#include "stripe/edges/background_edge.hpp"
#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

// What the chain of scan lines must say before it is believed,
constexpr float kProbable = 0.5F;
constexpr float kCertain = 0.9F;
// how near to it, in widths, a scan line's own candidate is the same peak,
constexpr double kFollowedReach = 2.0;
// and what a scan line must show itself, but for a few in a row: else the stripe is bridged, not
// seen.
constexpr float kLeastFollowed = 0.5F;
constexpr std::size_t kMostBridged = 3;
// Of more scan lines in a row, what they must show in the mean.
constexpr float kLeastMeanFollowed = 1.6F;
// Where the scan lines so far beside show a stripe of so many sigmas, at most so steep, none is
// bridged that has less than this part of it: existence is the scan line's own affair where the
// scan line can tell.
constexpr int kBeside = 4;
constexpr double kSteepestBeside = 3.0;
constexpr float kPlainSignificance = 5.5F;
constexpr float kLeastOfBeside = 0.4F;

// A scan line's only peak of so many sigmas is what the chain would take there too: the tracker
// counts no peak as more than 9 (kStrongest), and one of 8 is e^30 times likelier than none.
constexpr float kDecided = 8.0F;
// So many scan lines of that kind pin the chain at the end of a run. What lies elsewhere than in
// the scan line before is none of them: it may be a highlight.
constexpr int kPins = 4;

bool is_masked_at(const FrameAtHand& at_hand, int line, int across) {
  const cv::Mat& masked = at_hand.frame.masked;
  const bool is_masked =
      !masked.empty() && image_line<std::uint8_t>(masked, at_hand.axis, line)[across] != 0;
  return is_masked || at_hand.ignored.has(at_hand.axis, line, across);
}

// Judges the width and the edge only: that there is a stripe is known from the chain.
PeakLimits without_threshold(PeakLimits limits) {
  constexpr float kAny = -std::numeric_limits<float>::max();
  limits.significance = limits.weak_significance = limits.amplitude = limits.snr = kAny;
  return limits;
}

}  // namespace

void LineFollower::follow(const FrameAtHand& at_hand, const PeakCandidates& candidates,
                          const WidthModel& width, ProfilePlan plan, const PeakLimits& limits,
                          Stripe& stripe) {
  const LitFrame& frame = at_hand.frame;
  const PlanNoise& noise = at_hand.noise;
  const double typical = typical_width(width);
  tracked_.make_room(candidates.primary.size());
  tracked_.seeds.clear();
  weakly_supported_.assign(candidates.primary.size(), 0);
  find_undecided(candidates, stripe);
  tracker_.track(frame, stripe.axis, typical, noise, undecided_);
  for (const ContinuousTracker::Run& run : undecided_) {
    ask_chain(run, at_hand, candidates, width, stripe);
  }
  if (tracked_.seeds.empty()) return;
  measure_tracked(at_hand, typical, plan, limits, stripe);
}

// The runs of scan lines that the chain is asked about.
void LineFollower::find_undecided(const PeakCandidates& candidates, const Stripe& stripe) {
  const auto lines = static_cast<int>(candidates.primary.size());
  undecided_.clear();
  undecided_.reserve(candidates.primary.size());
  std::size_t at = 0;  // Of the secondary peaks, which are in order of their scan lines.
  for (int line = 0; line < lines; ++line) {
    const auto i = static_cast<std::size_t>(line);
    const std::vector<PeakSeed>& others = candidates.secondary.seeds;
    while (at < others.size() && others[at].line < line) ++at;
    const bool is_alone = at == others.size() || others[at].line != line;
    const bool is_decided = is_alone && stripe.status[i] == ReturnStatus::kOk &&
                            candidates.primary.significance[i] >= kDecided;
    const double step =
        line == 0 ? 0.0 : candidates.primary.position(i) - candidates.primary.position(i - 1);
    if (is_decided && std::abs(step) <= kSteepestBeside) continue;
    const int first = std::max(0, line - kPins);
    const int end = std::min(lines, line + kPins + 1);
    if (!undecided_.empty() && first <= undecided_.back().end) {
      undecided_.back().end = end;
    } else {
      undecided_.push_back({first, end});
    }
  }
}

void LineFollower::ask_chain(const ContinuousTracker::Run& run, const FrameAtHand& at_hand,
                             const PeakCandidates& candidates, const WidthModel& width,
                             Stripe& stripe) {
  for (int line = run.first; line < run.end; ++line) {
    const ContinuousTracker::Answer& answer = tracker_.of_line(line);
    const bool is_probable = answer.probability >= kProbable;
    if (is_probable && take_candidate(line, candidates, width, stripe)) continue;
    const auto i = static_cast<std::size_t>(line);
    // What hardly stands out and continues nothing is noise: the chain finds more at the same rate
    // of false alarms.
    if (stripe.status[i] == ReturnStatus::kWeak) stripe.drop(i, ReturnStatus::kNoStripe);
    const bool is_missing = verdict(stripe.status[i]) == Verdict::kMissing;
    if (is_probable && is_missing && !is_masked_at(at_hand, line, answer.across)) {
      tracked_.seeds.push_back({line, answer.across});
    }
  }
}

// Scan lines in which the chain knows of a stripe that no candidate shows.
void LineFollower::measure_tracked(const FrameAtHand& at_hand, double typical, ProfilePlan plan,
                                   const PeakLimits& limits, Stripe& stripe) {
  // The scan line alone would lose its way: the filter's peak is looked for close by and stands.
  plan.reach = plan.stray = std::max(1, static_cast<int>(typical));
  plan.aligned = 0;
  measure_profiles(at_hand.images, plan, tracked_.seeds.data(), static_cast<int>(tracked_.size()),
                   tracked_.measurements());
  for (std::size_t n = 0; n < tracked_.size(); ++n) {
    const PeakPlace place{tracked_.seeds[n].line, tracked_.across[n], typical, tracked_.level[n]};
    const double above = significance_above_edge(at_hand.frame, stripe.axis, at_hand.noise, place);
    tracked_.significance[n] = std::min(tracked_.significance[n], static_cast<float>(above));
  }
  judge_peaks(without_threshold(limits), tracked_);
  // However little a scan line shows, its peak is not farther off than it was looked for.
  const float farthest = limits.step * (static_cast<float>(plan.reach) + 0.5F);
  for (float& sigma : tracked_.sigma) sigma = std::min(sigma, farthest);
  put_tracked(at_hand.images.length, stripe);
}

bool LineFollower::take_candidate(int line, const PeakCandidates& candidates,
                                  const WidthModel& width, Stripe& stripe) {
  const ContinuousTracker::Answer& answer = tracker_.of_line(line);
  const LinePeaks peaks = peaks_of_line(candidates, line, candidates.first_secondary(line), width);
  const double near = kFollowedReach * width.at(answer.across) + 1.0;
  for (const LinePeak& peak : peaks) {
    if (std::abs(peak.position - answer.across) > near) continue;
    const auto i = static_cast<std::size_t>(line);
    const AxisGrid& grid = grid_across(stripe.grid, stripe.axis);
    const bool is_good = stripe.status[i] == ReturnStatus::kOk;
    const bool is_own = is_good && std::abs(grid.index(stripe.across_px[i]) - peak.position) < 1.0;
    // A scan line that can tell is overruled by a chain that is certain, and never doubted.
    if (is_good && !is_own && answer.probability < kCertain) return true;
    const float own_confidence = is_own ? stripe.confidence[i] : 0.0F;
    put_peak(peak, i, stripe);
    weakly_supported_[i] = peak.status() == ReturnStatus::kWeak ? 1 : 0;
    const bool is_sure = answer.probability >= kCertain && peak.status() == ReturnStatus::kWeak;
    if (is_sure) stripe.status[i] = ReturnStatus::kOk;
    stripe.confidence[i] = std::max(own_confidence, answer.probability);
    return true;
  }
  return false;
}

// Whether the scan lines beside a tracked one show the stripe so plainly that it would show here
// too.
bool LineFollower::lacks_stripe(std::size_t n, const Stripe& stripe) const {
  const int line = tracked_.seeds[n].line;
  const AxisGrid& across = grid_across(stripe.grid, stripe.axis);
  std::array<float, 2 * kBeside> amplitudes{};
  std::size_t count = 0;
  for (int other = std::max(0, line - kBeside); other <= line + kBeside; ++other) {
    const auto i = static_cast<std::size_t>(other);
    if (other == line || i >= stripe.size() || stripe.status[i] != ReturnStatus::kOk) continue;
    const double step = across.index(stripe.across_px[i]) - tracked_.position(n);
    if (std::abs(step) > kSteepestBeside * (std::abs(other - line) + 1)) continue;
    amplitudes[count++] = stripe.amplitude_dn[i];
  }
  if (count == 0) return false;
  std::span seen(amplitudes.data(), count);
  const float beside = upper_median(seen);
  const float own = tracked_.amplitude[n];
  const bool is_plain = beside * (tracked_.significance[n] / own) >= kPlainSignificance;
  return is_plain && own < kLeastOfBeside * beside;
}

void LineFollower::put_tracked(int length, Stripe& stripe) {
  for (std::size_t first = 0; first < tracked_.size();) {
    std::size_t end = first + 1;
    while (end < tracked_.size() && goes_on(end)) ++end;
    if (shows_on_the_whole(first, end)) put_run(first, end, length, stripe);
    first = end;
  }
}

bool LineFollower::goes_on(std::size_t n) const {
  return tracked_.seeds[n].line == tracked_.seeds[n - 1].line + 1;
}

// Whether a run of tracked scan lines shows a stripe in the mean; a gap shows what the chain could
// find in noise. A few scan lines are bridged.
bool LineFollower::shows_on_the_whole(std::size_t first, std::size_t end) const {
  if (end - first <= kMostBridged) return true;
  const auto begin = tracked_.significance.begin();
  const float sum = std::accumulate(begin + static_cast<std::ptrdiff_t>(first),
                                    begin + static_cast<std::ptrdiff_t>(end), 0.0F);
  return sum >= kLeastMeanFollowed * static_cast<float>(end - first);
}

void LineFollower::put_run(std::size_t first, std::size_t end, int length, Stripe& stripe) {
  std::size_t bridged = 0;
  for (std::size_t n = first; n < end; ++n) {
    const bool shows = tracked_.significance[n] > kLeastFollowed;
    bridged = shows ? 0 : bridged + 1;
    if (bridged > kMostBridged || lacks_stripe(n, stripe)) continue;
    if (!(tracked_.amplitude[n] > 0.0F)) continue;  // There is no light at all.
    const LinePeak peak{&tracked_, n, tracked_.position(n)};
    if (!(peak.position >= 0.0 && peak.position <= length - 1)) continue;
    const int line = tracked_.seeds[n].line;
    const auto i = static_cast<std::size_t>(line);
    put_peak(peak, i, stripe);
    weakly_supported_[i] = 1;
    const float probability = tracker_.of_line(line).probability;
    stripe.confidence[i] = probability;
    // The chain tells that there is a stripe, not that all of it is inside the image.
    if (peak.status() == ReturnStatus::kEdge) continue;
    stripe.status[i] = probability >= kCertain ? ReturnStatus::kOk : ReturnStatus::kWeak;
  }
}

void LineFollower::drop_unsupported(const BlockMaxima& blocks, bool is_doubted,
                                    Stripe& stripe) const {
  const auto is_isolated = [&](std::size_t i) {
    return weakly_supported_[i] != 0 && (is_doubted || blocks.is_partly_masked(stripe.line[i]));
  };
  for (std::size_t first = 0; first < weakly_supported_.size(); ++first) {
    if (!is_isolated(first)) continue;
    std::size_t end = first + 1;
    while (end < weakly_supported_.size() && is_isolated(end)) ++end;
    if (!goes_on_from(first, -1, stripe) && !goes_on_from(end - 1, 1, stripe)) {
      for (std::size_t i = first; i < end; ++i) stripe.drop(i, ReturnStatus::kNoStripe);
    }
    first = end - 1;
  }
}

// Whether most of the next scan lines on that side have a good return about there.
bool LineFollower::goes_on_from(std::size_t i, int direction, const Stripe& stripe) const {
  const AxisGrid& across = grid_across(stripe.grid, stripe.axis);
  int near = 0;
  for (int n = 1; n <= kBeside; ++n) {
    const std::ptrdiff_t beside = static_cast<std::ptrdiff_t>(i) + n * direction;
    if (beside < 0 || beside >= static_cast<std::ptrdiff_t>(weakly_supported_.size())) break;
    const auto other = static_cast<std::size_t>(beside);
    if (stripe.status[other] != ReturnStatus::kOk) continue;
    const double step = across.index(stripe.across_px[other]) - across.index(stripe.across_px[i]);
    if (std::abs(step) <= kSteepestBeside * (n + 1)) ++near;
  }
  return 2 * near > kBeside;
}

}  // namespace striper::detail
