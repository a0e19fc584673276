// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <striper/ambient/ambient_options.hpp>
#include <striper/ambient/ambient_status.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/illumination_pattern.hpp>
#include <striper/core/lit_frame.hpp>

#include "ambient/illumination/exposure_numbers.hpp"
#include "ambient/illumination/exposure_queue.hpp"
#include "ambient/illumination/given_pattern_check.hpp"
#include "ambient/illumination/line_watch.hpp"
#include "ambient/illumination/look_timer.hpp"
#include "ambient/illumination/pattern_finder.hpp"
#include "ambient/illumination/tracking_state.hpp"
#include "ambient/pixels/held_exposure.hpp"
#include "core/once_events.hpp"

namespace striper::detail {

/// Knows which exposures of a stream the laser lights: as it was given, as the frames say, or as
/// the images show. Its phases and what leads from one to another are in tracking_state.cpp.
class IlluminationTracker {
 public:
  /// Both outlive it.
  IlluminationTracker(const AmbientOptions& options, OnceEvents& events);
  IlluminationTracker(const IlluminationTracker&) = delete;
  IlluminationTracker& operator=(const IlluminationTracker&) = delete;

  /// @param is_of_interlaced_frame it has no illumination of its own where the two fields differ.
  void push(const Frame& exposure, bool is_of_interlaced_frame);
  void finish();
  bool is_finished() const noexcept { return is_finished_; }

  /// The oldest lit exposure that was not handed out; null if there is none yet.
  HeldExposure* next_lit() noexcept { return queue_.next_lit(); }
  const HeldExposures& held() const noexcept { return queue_.held(); }
  Neighbours neighbours_of(const HeldExposure& lit) noexcept;

  /// Whether a lit exposure has to have a dark one and has none; it is then passed over.
  bool pass_over_unpaired(HeldExposure& lit, const Neighbours& darks);

  /// Whether what was made of an exposure refutes the pattern: it gives nothing then, and what
  /// follows is held until the pattern is known again.
  bool is_refuted_by(const LitFrame& made, const HeldExposure& lit, const Neighbours& darks);

  /// Lets go of what no lit exposure can need.
  void forget() noexcept { queue_.forget(dark_choice()); }

  const TrackingState& state() const noexcept { return state_; }
  const IlluminationPattern& pattern() const noexcept { return queue_.pattern(); }
  PatternOrigin origin() const noexcept { return origin_; }
  std::uint64_t dark_exposures() const noexcept { return queue_.dark_exposures(); }
  std::uint64_t unpaired_exposures() const noexcept { return unpaired_; }

 private:
  // What was known before the source lost its place.
  struct Before {
    IlluminationPattern pattern;
    std::uint64_t number = 0;  // Of the last exposure.
  };

  void apply_stated_illumination(const Frame& exposure, std::uint64_t number);
  void apply_unstated_illumination(std::uint64_t number, bool is_reopened);
  void search_anew(TrackingSignal why);
  void look(const Frame& exposure, std::uint64_t number);
  bool is_given_at_once(const Frame& exposure) const noexcept;
  void conclude(const PatternFinder::Finding& finding);
  void conclude_found(const IlluminationPattern& found);
  void conclude_not_found(const PatternFinder::Finding& finding);
  void conclude_from_labels();
  void find_phase(const PatternFinder::Finding& finding);
  void judge_given(const PatternFinder::Finding& finding);
  void say_nothing_is_taken_off(const PatternFinder::Finding& finding);
  void check_field_order();
  void check_rows(const HeldExposure& unpaired);
  void settle(const IlluminationPattern& pattern, PatternOrigin how);
  void doubt_given();
  void look_again_after(const HeldExposure& refuted);
  DarkChoice dark_choice() const noexcept;

  const AmbientOptions& options_;
  OnceEvents& events_;
  ExposureNumbers numbers_;
  ExposureQueue queue_;
  PatternFinder finder_;
  LookTimer looks_;
  TrackingState state_;
  PatternOrigin origin_ = PatternOrigin::kNone;
  GivenPatternCheck given_;
  LineWatch lines_;
  Before before_;
  // While nobody says what is lit: every exposure so far showed the stripe, and was given.
  bool are_all_lit_so_far_ = true;
  int until_next_doubt_ = 0;
  std::uint64_t unpaired_ = 0;
  bool is_finished_ = false;
};

}  // namespace striper::detail
