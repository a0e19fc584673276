// SPDX-License-Identifier: Apache-2.0
#include "ambient/illumination/tracking_state.hpp"

#include <algorithm>
#include <iterator>
#include <optional>

namespace striper::detail {
namespace {

using enum TrackingPhase;
using enum TrackingSignal;

// From any phase where none is named.
struct PhaseRow {
  TrackingSignal signal;
  std::optional<TrackingPhase> from;
  TrackingPhase to;
};

// The rows are read in order. A pattern that was given is kGiven where it would be kLocked, and a
// search for the place in a known pattern is kLost where it would be kSearching.
constexpr PhaseRow kPhases[] = {
    {kSettled, {}, kLocked},             //
    {kRestarted, {}, kSearching},        //
    {kPlaceLost, {}, kLost},             //
    {kLabelsHeard, kGiven, kLocked},     //
    {kLabelsHeard, kLost, kSearching},   //
    {kRefuted, kLocked, kSuspect},       //
    {kUnfounded, kSuspect, kSearching},  //
};

struct TellerRow {
  TrackingSignal signal;
  Teller from;
  Teller to;
};

constexpr TellerRow kTellers[] = {
    {kLabelsHeard, Teller::kImages, Teller::kFrames},
    {kLabelsHeard, Teller::kGiven, Teller::kFrames},
    {kLabelsHeard, Teller::kGivenNoPlace, Teller::kFrames},
    {kLabelsHeard, Teller::kFramesNoPlace, Teller::kFrames},
    {kPlaceLost, Teller::kGiven, Teller::kGivenNoPlace},
    {kPlaceLost, Teller::kFrames, Teller::kFramesNoPlace},
};

}  // namespace

void TrackingState::on(TrackingSignal signal) noexcept {
  const auto* const teller = std::find_if(
      std::begin(kTellers), std::end(kTellers),
      [&](const TellerRow& row) { return row.signal == signal && row.from == teller_; });
  if (teller != std::end(kTellers)) teller_ = teller->to;
  const auto* const row =
      std::find_if(std::begin(kPhases), std::end(kPhases), [&](const PhaseRow& candidate) {
        return candidate.signal == signal && candidate.from.value_or(phase_) == phase_;
      });
  if (row == std::end(kPhases)) return;
  phase_ = row->to;
  if (phase_ == kLocked && is_given()) phase_ = TrackingPhase::kGiven;
  if (phase_ == kSearching && has_no_place()) phase_ = kLost;
}

}  // namespace striper::detail
