// SPDX-License-Identifier: Apache-2.0
#include "stripe/candidates/peak_measurer.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "stripe/edges/background_edge.hpp"
#include "stripe/profile/profile_kernel.hpp"

namespace striper::detail {
namespace {

// The background's own error limits the significance of peaks below this.
constexpr float kWeakSignificance = 8.0F;
// Below this, no better background makes a peak of it.
constexpr float kHopelessSignificance = 2.5F;

// What a stripe beside an edge shows above the brighter side, in sigmas: less than in all of a
// scan line, since there are few places where noise may do so.
constexpr double kLeastAboveEdge = 3.5;

// Whether what brightens the place's sides may be the scan line's most prominent peak, and no edge.
bool is_beside_primary(const PeakMeasurer::Task& task, const PeakPlace& place) {
  const auto line = static_cast<std::size_t>(place.line);
  return task.primary->significance[line] >= static_cast<float>(task.threshold) &&
         std::abs(task.primary->position(line) - place.across) <=
             disturbed_by_neighbours_px(place.width);
}

}  // namespace

void PeakMeasurer::make_room(std::size_t most) {
  weak_.make_room(most);
  weak_index_.reserve(most);
}

void PeakMeasurer::measure(const Task& task, PeakList& peaks) {
  measure_profiles(task.at_hand.images, task.plan, peaks.seeds.data(),
                   static_cast<int>(peaks.size()), peaks.measurements());
  measure_weak_again(task, peaks);
  refuse_edges(task, peaks);
}

// Of what is weak, or so near the border that the background is seen on one side only, whose slope
// then needs more of it.
void PeakMeasurer::measure_weak_again(const Task& task, PeakList& peaks) {
  // Without branches: nearly always the answer is no, a vector at a time.
  const auto needs_it = [&, border = task.plan.window,
                         last =
                             task.at_hand.images.length - task.plan.window](std::size_t i) -> int {
    const float significance = peaks.significance[i];
    const std::int32_t across = peaks.across[i];
    const int is_weak = (significance < kWeakSignificance) & (significance > kHopelessSignificance);
    const int is_near_border = (across < border) | (across >= last);
    return is_weak | is_near_border;
  };
  int any = 0;
  for (std::size_t i = 0; i < peaks.size(); ++i) any |= needs_it(i);
  if (any == 0) return;

  weak_.seeds.clear();
  weak_index_.clear();
  for (std::size_t i = 0; i < peaks.size(); ++i) {
    if (needs_it(i) == 0) continue;
    weak_.seeds.push_back({peaks.seeds[i].line, peaks.across[i]});
    weak_index_.push_back(i);
  }
  measure_profiles(task.at_hand.images,
                   plan_profile(task.width, task.at_hand.noise, refine_, BackgroundReach::kWide),
                   weak_.seeds.data(), static_cast<int>(weak_.size()), weak_.measurements());
  for (std::size_t n = 0; n < weak_.size(); ++n) {
    peaks.take(weak_index_[n], weak_, n);
    refuse_edge(task, weak_index_[n], peaks);
  }
}

void PeakMeasurer::refuse_edges(const Task& task, PeakList& peaks) {
  // An edge tilts the background, unless at its very border, by a third of its height or more over
  // such a distance.
  const auto distance = static_cast<float>(3 * (task.plan.core + task.plan.window));
  const auto is_tilted = [&](std::size_t i) -> int {
    return distance * std::abs(peaks.slope[i]) > peaks.amplitude[i];
  };
  constexpr std::size_t kTogether = 16;  // Nearly always the answer is no, a vector at a time.
  for (std::size_t first = 0; first < peaks.size(); first += kTogether) {
    const std::size_t last = std::min(first + kTogether, peaks.size());
    int any = 0;
    for (std::size_t i = first; i < last; ++i) any |= is_tilted(i);
    if (any == 0) continue;
    for (std::size_t i = first; i < last; ++i) {
      if (is_tilted(i) != 0) refuse_edge(task, i, peaks);
    }
  }
}

void PeakMeasurer::refuse_edge(const Task& task, std::size_t i, PeakList& peaks) {
  if (!(peaks.significance[i] >= task.threshold)) return;
  const PeakPlace place{peaks.seeds[i].line, peaks.across[i], typical_width(task.width),
                        peaks.level[i]};
  if (task.primary != nullptr && is_beside_primary(task, place)) return;
  const double above =
      significance_above_edge(task.at_hand.frame, task.at_hand.axis, task.at_hand.noise, place);
  if (above >= kLeastAboveEdge) return;
  // Nor does the width, or the follower, learn from it.
  peaks.blank(i);
}

}  // namespace striper::detail
