// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/ambient/cadence_finder.hpp>
#include <striper/ambient/colour_difference.hpp>
#include <striper/core/event.hpp>

#include "ambient/illumination/exposure_numbers.hpp"
#include "ambient/illumination/exposure_queue.hpp"
#include "ambient/illumination/line_sign.hpp"
#include "ambient/pixels/background.hpp"
#include "ambient/pixels/temporal_background.hpp"

namespace striper {

/// What an AmbientStage knows of its stream. What comes in, and what is made of it (cadence, field
/// order, warnings), is in ambient_decisions.cpp; what goes out (pairs, channel, subtraction) in
/// ambient_stage.cpp.
struct AmbientStage::State {
  explicit State(const AmbientOptions& options_in)
      : options(options_in),
        finder(options_in.axis, options_in.lasers),
        background(options_in.noise) {
    if (!options.cadence.is_automatic()) settle(options.cadence, PatternOrigin::kGiven);
    if (options.channel != Channel::kAuto) channel = options.channel;
  }

  // ---- What comes in.
  /// @param is_of_woven_picture it has no illumination of its own where the two fields differ.
  void push_exposure(const Frame& exposure, bool is_of_woven_picture);
  void heed_own_illumination(const Frame& exposure, std::uint64_t number);
  void heed_unknown_illumination(std::uint64_t number, bool is_reopened);
  void find_phase(const CadenceFinder::Finding& finding);
  bool is_phase_searched() const noexcept { return is_source_unsure && !is_settled; }
  void look(const Frame& exposure, std::uint64_t number);
  void conclude(const CadenceFinder::Finding& finding);
  void judge_given(const CadenceFinder::Finding& finding);
  void judge_given_at_end();
  void contradict_given(EventCode code, const std::string& what);
  void contradict_given(const Cadence& shown);
  void say_that_nothing_tells_apart();
  void doubt_given();
  // It is what was given that says which exposures are lit.
  bool is_given() const noexcept {
    return !options.cadence.is_automatic() && !has_own_illumination && !is_source_unsure;
  }
  bool is_to_be_confirmed() const noexcept { return !otherwise.is_automatic(); }
  void say_nothing_is_taken_off(const CadenceFinder::Finding& finding);
  void conclude_from_labels();
  void check_field_order();
  void check_method(const Frame& exposure);
  void check_rows(const detail::HeldExposure& unpaired_exposure);
  void settle(const Cadence& cadence, PatternOrigin how);
  void send(EventCode code, const std::string& message);
  void send_once(Event event);
  TrackingPhase phase() const noexcept;

  // ---- What goes out.
  detail::DarkChoice choice() const noexcept;
  void give(detail::HeldExposure& exposure, const detail::Neighbours& darks);
  bool is_refuted(const detail::Neighbours& darks);
  void look_again_after(const detail::HeldExposure& refuted);
  void subtract(detail::HeldExposure& exposure, const detail::Neighbours& darks);
  void subtract_background(detail::HeldExposure& exposure);
  void choose_channel_from(const detail::HeldExposure& exposure, const detail::HeldExposure* dark);
  void take_channel(detail::HeldExposure& exposure, Channel wanted) const;
  Channel channel_of_differences() const noexcept;
  bool subtracts() const noexcept;
  bool background_waits(const detail::HeldExposure& exposure);
  detail::TemporalBackground& background_of(const detail::HeldExposure& exposure);

  AmbientOptions options;
  detail::ExposureNumbers numbers;
  detail::ExposureQueue queue;

  CadenceFinder finder;
  bool is_looking = true;
  int until_next_look = 0;
  // Of a cadence that was given: what the last look at the pictures said.
  Cadence otherwise;  // Another one, less than plainly.
  int unclear_looks = 0;
  bool is_judged = false;  // Confirmed or refuted.
  bool is_settled = false;
  bool has_own_illumination = false;
  // The source said what lights its exposures and no longer does: it is the same cadence, begun
  // anywhere.
  bool is_source_unsure = false;
  Cadence surely;  // What it said, or was given, before.
  std::uint64_t last_number = 0;
  PatternOrigin origin = PatternOrigin::kNone;
  detail::LineSign line_sign;
  std::vector<bool> was_plain;  // Per laser: its line, in the last exposure that it lit.
  bool is_in_doubt = false;     // The cadence that was found does not fit what came.
  int until_next_doubt = 0;
  int looks_for_weave = 3;  // First pictures still to be looked at: may they be woven?
  int moving_pictures = 0;  // In a row.
  std::vector<EventCode> said;

  std::optional<Channel> channel;
  bool is_finished = false;
  detail::Background background;
  ColourDifference colour_difference;
  std::vector<detail::TemporalBackground> temporal;  // Per laser and parity.
  bool subtracts_fields = false;
  bool subtracts_pictures = false;

  LitFrame lit;
  std::uint64_t unpaired = 0;
};

}  // namespace striper
