// SPDX-License-Identifier: Apache-2.0
#include "stripe/candidates/candidate_finder.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <opencv2/core.hpp>

#include "stripe/profile/line_view.hpp"
#include "stripe/profile/profile_kernel.hpp"
#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {
namespace {

// So often the brightest thing of a frame's scan lines, no noise, may change before ridges are
// looked for; and in so many there may be none, though they have surfaces of different brightness.
constexpr double kMostUnclear = 0.03;
constexpr double kMostEmpty = 0.03;
constexpr double kOtherSurface = 12.0;  // Sigmas of noise from a block's maximum to the next one's.
// Ridges are compared with pixels so many widths off, where a stripe has 6 % of its height, at
// least and at most so many pixels.
constexpr double kRidgeReach = 2.4;
constexpr double kLeastRidgeReach = 2.0;
constexpr double kMostRidgeReach = 24.0;
constexpr double kLeastRidge = 3.0;  // Sigmas of noise.

}  // namespace

CandidateFinder::CandidateFinder(const ExtractOptions& options)
    : options_(options), measurer_(options.method == ExtractMethod::kRefined) {}

void CandidateFinder::begin(const LitFrame& frame) {
  ridges_.reserve(frame.lit.size(), options_.axis);
  clipped_runs_.reserve(frame, options_.axis);
  ridges_at_edges_.reserve(frame, options_.axis);
  blocks_.find(frame, options_.axis);
  blocks_.rank(BlockMaxima::kFirst);
  detection_.prepare(line_length(frame.lit, options_.axis), options_.false_alarm_rate,
                     options_.weak_false_alarm_rate);
}

void CandidateFinder::find(const FrameAtHand& at_hand, const SearchedPart& part,
                           const WidthModel& width) {
  const bool refine = options_.method == ExtractMethod::kRefined;
  const ProfilePlan plan = plan_profile(width, at_hand.noise, refine, BackgroundReach::kUsual);
  candidates_.choose(at_hand.frame, options_.axis, blocks_, at_hand.noise_dn, plan);
  measurer_.make_room(static_cast<std::size_t>(blocks_.lines()) * Ridges::kMost);
  const double threshold = detection_.threshold();
  measurer_.measure({at_hand, width, plan, threshold, nullptr}, candidates_.primary);
  candidates_.look_behind(static_cast<float>(threshold), at_hand.frame, options_.axis, blocks_);
  measurer_.measure({at_hand, width, plan, threshold, &candidates_.primary}, candidates_.secondary);
  is_hidden_ = is_hidden_by_background(at_hand);
  if (is_hidden_) take_ridges(at_hand, width);
  drop_what_is_none(part);
}

void CandidateFinder::find_ridges(const FrameAtHand& at_hand, const SearchedPart& part,
                                  const WidthModel& width) {
  is_hidden_ = true;
  take_ridges(at_hand, width);
  drop_what_is_none(part);
}

void CandidateFinder::drop_what_is_none(const SearchedPart& part) {
  part.refuse_outside(candidates_.primary);
  part.refuse_outside(candidates_.secondary);
  candidates_.blank_flat_lines();
}

// Whether the brightest thing of a scan line so often is another than that of the next that the
// stripe may not be among the brightest pixels; or so often is none, and brighter surfaces are in
// the scan line: on a dark one of them the stripe is not the brightest.
bool CandidateFinder::is_hidden_by_background(const FrameAtHand& at_hand) const {
  if (is_background_subtracted(at_hand.frame) || options_.each_line_by_itself) return false;
  const auto unclear = static_cast<double>(candidates_.unclear_lines(kClearSignificance));
  if (unclear > kMostUnclear * blocks_.lines()) return true;
  const PlanNoise& noise = at_hand.noise;
  int empty = 0;
  for (int line = 0; line < blocks_.lines(); ++line) {
    if (blocks_.is_partly_masked(line) || candidates_.has_peak(line, kClearSignificance)) continue;
    const double variance_dn2 =
        noise.model.variance_dn2(blocks_.brightest_dn(line)) * (1.0 + noise.dark_noise_gain);
    const double step_dn = blocks_.largest_step_dn(line);
    empty += step_dn * step_dn > kOtherSurface * kOtherSurface * variance_dn2 ? 1 : 0;
  }
  return empty > kMostEmpty * blocks_.lines();
}

// Between surfaces: an edge is no ridge, and a wide background would have other surfaces in it.
void CandidateFinder::take_ridges(const FrameAtHand& at_hand, const WidthModel& width) {
  const auto reach = static_cast<int>(
      std::ceil(std::clamp(kRidgeReach * typical_width(width), kLeastRidgeReach, kMostRidgeReach)));
  const int least_dn = std::max(2, static_cast<int>(kLeastRidge * at_hand.noise_dn));
  const LitFrame& frame = at_hand.frame;
  if (!frame.dark.empty()) cv::subtract(frame.lit, frame.dark, difference_);
  const cv::Mat& image = frame.dark.empty() ? frame.lit : difference_;
  const bool refine = options_.method == ExtractMethod::kRefined;
  const ProfilePlan plan = plan_profile(width, at_hand.noise, refine, BackgroundReach::kNarrow);
  const auto most_clipped_px = static_cast<int>(kMostClippedWidths * plan.largest_width + 1.0F);
  ridges_.find(image, options_.axis, reach, least_dn);
  clipped_runs_.add_to(ridges_, frame, options_.axis, {reach, most_clipped_px, least_dn});
  candidates_.take_ridges(ridges_);
  for (PeakList* const peaks : {&candidates_.primary, &candidates_.secondary}) {
    measure_profiles(at_hand.images, plan, peaks->seeds.data(), static_cast<int>(peaks->size()),
                     peaks->measurements());
  }
  const RidgesAtEdges::Measured measured{at_hand, plan, reach};
  ridges_at_edges_.measure(measured, candidates_.primary_rises(), candidates_.primary);
  ridges_at_edges_.measure(measured, candidates_.secondary_rises(), candidates_.secondary);
  candidates_.blank_false_ridges();
}

}  // namespace striper::detail
