// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "stripe/candidates/peak_list.hpp"
#include "stripe/profile/frame_at_hand.hpp"
#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {

/// Measures peaks by the stripe's own profile; what is weak with more background, and what is no
/// more than an edge is blanked.
class PeakMeasurer {
 public:
  struct Task {
    const FrameAtHand& at_hand;
    const WidthModel& width;
    ProfilePlan plan;
    double threshold;         ///< Of significance.
    const PeakList* primary;  ///< What may lie beside them, measured; null: it is these.
  };

  explicit PeakMeasurer(bool refine) : refine_(refine) {}

  /// For so many weak peaks; no allocation once there was as much.
  void make_room(std::size_t most);

  void measure(const Task& task, PeakList& peaks);

 private:
  void measure_weak_again(const Task& task, PeakList& peaks);
  static void refuse_edges(const Task& task, PeakList& peaks);
  static void refuse_edge(const Task& task, std::size_t i, PeakList& peaks);

  bool refine_;
  PeakList weak_;
  std::vector<std::size_t> weak_index_;
};

}  // namespace striper::detail
