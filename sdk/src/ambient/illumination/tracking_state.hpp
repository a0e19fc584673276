// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <striper/ambient/ambient_status.hpp>

namespace striper::detail {

/// Who says which exposures the laser lights.
enum class Teller : std::uint8_t {
  kImages,         ///< Nobody: they are asked.
  kGiven,          ///< Whoever gave the pattern.
  kFrames,         ///< Each frame its own.
  kGivenNoPlace,   ///< A pattern was given, and where in it the source began anew is not known.
  kFramesNoPlace,  ///< The frames did, and the source no longer knows.
};

/// What happens to the tracking of a pattern.
enum class TrackingSignal : std::uint8_t {
  kSettled,      ///< The pattern is known.
  kRestarted,    ///< The source counts anew, and the images are asked again.
  kPlaceLost,    ///< The source lost its place in a pattern that is known.
  kLabelsHeard,  ///< A frame says what lights it.
  kRefuted,      ///< An exposure does not fit the pattern.
  kUnfounded,    ///< What refuted it says nothing, or not which pattern it is.
};

/// How sure it is of what lights an exposure, and by whose word.
class TrackingState {
 public:
  explicit TrackingState(Teller teller) noexcept : teller_(teller) {}

  /// The table of transitions: where it says nothing of a signal the phase stays.
  void on(TrackingSignal signal) noexcept;

  TrackingPhase phase() const noexcept { return phase_; }
  bool is_settled() const noexcept {
    return phase_ == TrackingPhase::kLocked || phase_ == TrackingPhase::kGiven;
  }
  bool is_suspect() const noexcept { return phase_ == TrackingPhase::kSuspect; }

  /// It is what was given that says which exposures are lit.
  bool is_given() const noexcept { return teller_ == Teller::kGiven; }
  bool is_of_images() const noexcept { return teller_ == Teller::kImages; }
  bool is_of_frames() const noexcept { return teller_ == Teller::kFrames; }
  /// It is the same pattern as before, begun anywhere.
  bool has_no_place() const noexcept {
    return teller_ == Teller::kGivenNoPlace || teller_ == Teller::kFramesNoPlace;
  }
  /// The frames say or said it.
  bool was_of_frames() const noexcept {
    return teller_ == Teller::kFrames || teller_ == Teller::kFramesNoPlace;
  }

 private:
  Teller teller_;
  TrackingPhase phase_ = TrackingPhase::kSearching;
};

}  // namespace striper::detail
