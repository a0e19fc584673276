// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <striper/ambient/ambient_options.hpp>
#include <striper/core/channel.hpp>
#include <striper/core/lit_frame.hpp>

#include "ambient/pixels/background.hpp"
#include "ambient/pixels/colour_difference.hpp"
#include "ambient/pixels/held_exposure.hpp"
#include "ambient/pixels/temporal_background.hpp"
#include "core/once_events.hpp"

namespace striper::detail {

/// Makes the lit frame of an exposure: picks the channel, subtracts the dark exposures beside it or
/// what stands still. It is told which exposures are lit and dark.
class LitFrameMaker {
 public:
  /// Both outlive it.
  LitFrameMaker(const AmbientOptions& options, OnceEvents& events);
  LitFrameMaker(const LitFrameMaker&) = delete;
  LitFrameMaker& operator=(const LitFrameMaker&) = delete;

  /// @param held what a background may begin with.
  /// @return valid until the next call.
  const LitFrame& make(HeldExposure& lit, const Neighbours& darks, const HeldExposures& held);

  /// Whether a background that is tracked over time waits for more frames like this one.
  bool waits_for_background(const HeldExposure& lit, const HeldExposures& held);

  /// What was searched last; empty until it is chosen.
  std::optional<Channel> channel() const noexcept;

  /// What is subtracted; never kAuto.
  AmbientMethod method() const noexcept;

 private:
  void subtract(HeldExposure& lit, const Neighbours& darks, const HeldExposures& held);
  void subtract_dark(const HeldExposure& lit, const Neighbours& darks, Channel wanted);
  void subtract_background(HeldExposure& lit, const HeldExposures& held);
  void choose_channel_from(const HeldExposure& lit, const HeldExposure* dark);
  Channel channel_of_differences() const noexcept;
  TemporalBackground& background_of(const HeldExposure& lit);

  const AmbientOptions& options_;
  OnceEvents& events_;
  std::optional<Channel> channel_;
  Background background_;
  ColourDifference colour_difference_;
  std::vector<TemporalBackground> standing_;  // Per laser and parity.
  int moving_frames_ = 0;                     // In a row.
  bool subtracts_fields_ = false;
  bool subtracts_frames_ = false;
  LitFrame made_;
};

}  // namespace striper::detail
