// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include <striper/core/frame_source.hpp>
#include <striper/core/illumination_pattern.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper {

/// Whether a laser's trigger and a camera's shutter run together, as the images show it.
enum class SyncVerdict {
  kLocked,        ///< The same exposures of every few are lit, all the time.
  kSlipping,      ///< Sometimes the ones, sometimes others: the trigger runs free or exposures get
                  ///< lost.
  kNoDifference,  ///< No exposure shows more of a stripe than another: laser off, or on in all.
  kTooFew,        ///< Not enough good frames to tell.
};

/// What a sync check found.
struct SyncReport {
  SyncVerdict verdict = SyncVerdict::kTooFew;

  /// Which exposures are lit, as in `laser=`; automatic unless locked.
  IlluminationPattern pattern;
  /// Where exposures are fields and only those of one parity are lit: kTop or kBottom.
  Field lit_field = Field::kProgressive;

  static constexpr int kWindowFrames = 6;

  // So many frames at a time were looked at. How many of these windows
  std::uint64_t windows = 0;   ///< there were,
  std::uint64_t agreeing = 0;  ///< showed the pattern that most of them show,
  std::uint64_t others = 0;    ///< showed another one, or lit exposures in no order,
  std::uint64_t unclear = 0;   ///< showed no difference between exposures.
  /// How much more of a stripe lit exposures show than dark ones, of what a clear stripe gives: 0
  /// to 1. The mean of the windows that agree.
  double surplus = 0.0;

  double rate_hz = 0.0;               ///< Frames, measured by the source's own times.
  double nominal_rate_hz = 0.0;       ///< 0 if unknown.
  double jitter_ms = 0.0;             ///< RMS deviation of the times from an even beat.
  Field field = Field::kProgressive;  ///< As the source gives them.
  int exposures_per_picture = 1;
  SourceStatistics statistics;
};

struct SyncCheckOptions {
  double seconds = 3.0;                ///< Of the source's own time.
  std::function<bool()> is_cancelled;  ///< Asked between frames; may be empty.
  StripeAxis axis = StripeAxis::kColumns;
};

/// Watches a source and tells whether the laser fires in step with the shutter, and in which
/// exposures.
///
/// It looks at six frames at a time, lot after lot, as a Scanner does that was not told the
/// pattern, in whatever daylight it sees the stripe. The source is started and stopped.
///
/// @throws Error what the source's `start` throws.
SyncReport check_sync(FrameSource& source, const SyncCheckOptions& options = {});

}  // namespace striper
