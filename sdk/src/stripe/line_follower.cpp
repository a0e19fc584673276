// SPDX-License-Identifier: Apache-2.0
#include "stripe/line_follower.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace striper::detail {
namespace {

// What the chain of lines must say before it is believed,
constexpr float kProbable = 0.5F;
constexpr float kCertain = 0.9F;
// how near to it, in widths, a line's own candidate is the same peak,
constexpr double kFollowedReach = 2.0;
// and what a line must show itself, but for a few in a row: else the stripe is bridged, not seen.
constexpr float kLeastFollowed = 0.5F;
constexpr int kMostBridged = 3;

// Judges the width and the edge only: that there is a stripe is known from the chain.
PeakLimits without_threshold(PeakLimits limits) {
  constexpr float kAny = -std::numeric_limits<float>::max();
  limits.significance = limits.weak_significance = limits.amplitude = limits.snr = kAny;
  return limits;
}

}  // namespace

void LineFollower::follow(const LitFrame& frame, const ProfileImages& images,
                          const PeakCandidates& candidates, const WidthModel& width,
                          ProfilePlan plan, const PeakLimits& limits, const PlanNoise& noise,
                          Stripe& stripe) {
  const double typical = width.at_pivot;
  tracker_.track(frame, stripe.axis, typical, noise);
  const auto lines = static_cast<int>(candidates.firsts.size());
  followed_.make_room(candidates.firsts.size());
  followed_.seeds.clear();
  for (int line = 0; line < lines; ++line) {
    const ContinuousTracker::Answer& answer = tracker_.of_line(line);
    if (answer.probability < kProbable) continue;
    if (take_candidate(line, candidates, width, stripe)) continue;
    const ReturnStatus status = stripe.status[static_cast<std::size_t>(line)];
    if (status == ReturnStatus::kNoStripe || status == ReturnStatus::kWeak) {
      followed_.seeds.push_back({line, answer.across});
    }
  }
  if (followed_.seeds.empty()) return;
  // The line alone would lose its way: the filter's peak is looked for close by and stands.
  plan.reach = plan.stray = std::max(1, static_cast<int>(typical));
  measure_profiles(images, plan, followed_.seeds.data(), static_cast<int>(followed_.size()),
                   followed_.measurements());
  judge_peaks(without_threshold(limits), followed_);
  put_followed(images.length, stripe);
}

bool LineFollower::take_candidate(int line, const PeakCandidates& candidates,
                                  const WidthModel& width, Stripe& stripe) const {
  const ContinuousTracker::Answer& answer = tracker_.of_line(line);
  const LinePeaks peaks = peaks_of_line(candidates, line, candidates.first_extra(line), width);
  const double near = kFollowedReach * width.at(answer.across) + 1.0;
  for (const LinePeak& peak : peaks) {
    if (std::abs(peak.position - answer.across) > near) continue;
    const auto i = static_cast<std::size_t>(line);
    put_peak(peak, i, stripe);
    const bool is_sure = answer.probability >= kCertain && peak.status() == ReturnStatus::kWeak;
    if (is_sure) stripe.status[i] = ReturnStatus::kOk;
    stripe.confidence[i] = answer.probability;
    return true;
  }
  return false;
}

void LineFollower::put_followed(int length, Stripe& stripe) const {
  int bridged = 0;
  for (std::size_t n = 0; n < followed_.size(); ++n) {
    const int line = followed_.seeds[n].line;
    const bool goes_on = n > 0 && followed_.seeds[n - 1].line == line - 1;
    const bool shows = followed_.significance[n] > kLeastFollowed;
    bridged = shows ? 0 : (goes_on ? bridged + 1 : 1);
    if (bridged > kMostBridged) continue;
    const LinePeak peak{&followed_, n, followed_.position(n)};
    if (!(peak.position >= 0.0 && peak.position <= length - 1)) continue;
    const auto i = static_cast<std::size_t>(line);
    put_peak(peak, i, stripe);
    const float probability = tracker_.of_line(line).probability;
    stripe.status[i] = probability >= kCertain ? ReturnStatus::kOk : ReturnStatus::kWeak;
    stripe.confidence[i] = probability;
  }
}

}  // namespace striper::detail
