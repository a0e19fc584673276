// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "stripe/candidates/block_maxima.hpp"
#include "stripe/profile/frame_at_hand.hpp"
#include "stripe/select/line_choice.hpp"
#include "stripe/select/peak_judge.hpp"
#include "stripe/track/continuous_tracker.hpp"

namespace striper::detail {

/// The rule `continuous`, after every scan line has been decided by itself: where the stripe of all
/// scan lines together runs through a candidate of a scan line, that one is taken; where there is
/// none, what is there is measured. A scan line whose only peak is strong keeps it: existence is
/// the scan line's own affair where the scan line can tell.
///
/// Scan lines that decide by themselves are not asked again: one strong good peak, alone in its
/// scan line. They pin the chain, so that it is run over the other scan lines and a few of them on
/// either side.
class LineFollower {
 public:
  /// @param plan for weak peaks, not refined. @param limits those of the frame.
  void follow(const FrameAtHand& at_hand, const PeakCandidates& candidates, const WidthModel& width,
              ProfilePlan plan, const PeakLimits& limits, Stripe& stripe);

  /// After `follow`: of scan lines side by side that are partly masked, drops what the chain alone
  /// made a return of, unless it goes on in a scan line that is not. Where the stripe is hidden the
  /// chain finds what else there is. @param is_doubted whether that is so of every scan line.
  void drop_unsupported(const BlockMaxima& blocks, bool is_doubted, Stripe& stripe) const;

 private:
  void find_undecided(const PeakCandidates& candidates, const Stripe& stripe);
  void ask_chain(const ContinuousTracker::Run& run, const FrameAtHand& at_hand,
                 const PeakCandidates& candidates, const WidthModel& width, Stripe& stripe);
  void measure_tracked(const FrameAtHand& at_hand, double typical, ProfilePlan plan,
                       const PeakLimits& limits, Stripe& stripe);
  bool take_candidate(int line, const PeakCandidates& candidates, const WidthModel& width,
                      Stripe& stripe);
  bool goes_on_from(std::size_t i, int direction, const Stripe& stripe) const;
  bool lacks_stripe(std::size_t n, const Stripe& stripe) const;
  bool goes_on(std::size_t n) const;
  bool shows_on_the_whole(std::size_t first, std::size_t end) const;
  void put_run(std::size_t first, std::size_t end, int length, Stripe& stripe);
  void put_tracked(int length, Stripe& stripe);

  ContinuousTracker tracker_;
  std::vector<ContinuousTracker::Run> undecided_;
  PeakList tracked_;
  std::vector<std::uint8_t>
      weakly_supported_;  // Per scan line: on the chain, the scan line alone shows too little.
};

}  // namespace striper::detail
