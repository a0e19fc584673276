// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include <striper/core/frame_source.hpp>

namespace striper {

/// Whether a laser's trigger and a camera's shutter run together, as the pictures show it.
enum class SyncVerdict {
  kLocked,    ///< Every second exposure is lit, always the same one of the two.
  kSlipping,  ///< Sometimes the one, sometimes the other: the trigger runs free or exposures get
              ///< lost.
  kNoDifference,  ///< No exposure is brighter than its neighbour: laser off, or on in all of them.
  kTooFew,        ///< Not enough good pictures to tell.
};

/// What a sync check found.
struct SyncReport {
  SyncVerdict verdict = SyncVerdict::kTooFew;

  /// Of the exposures in time order (`Frame::exposure_number`), the even or the odd ones are lit.
  /// With two fields a picture that is its first (0) or second (1) field. -1 unless locked.
  int lit_phase = -1;
  Field lit_field = Field::kProgressive;  ///< kTop or kBottom where exposures are fields.

  std::uint64_t pairs = 0;       ///< Neighbouring exposures that were compared.
  std::uint64_t lit_even = 0;    ///< Of these, how many showed a stripe in the even exposure alone,
  std::uint64_t lit_odd = 0;     ///< in the odd one alone,
  std::uint64_t undecided = 0;   ///< in neither or both.
  double stripe_contrast = 0.0;  ///< Mean stripe height over that of the unlit exposure's noise.

  double rate_hz = 0.0;               ///< Pictures, measured by the source's own times.
  double nominal_rate_hz = 0.0;       ///< 0 if unknown.
  double jitter_ms = 0.0;             ///< RMS deviation of the times from an even beat.
  Field field = Field::kProgressive;  ///< As the source gives them.
  int exposures_per_picture = 1;
  SourceStatistics statistics;
};

struct SyncCheckOptions {
  double seconds = 3.0;                ///< Of the source's own time.
  std::function<bool()> is_cancelled;  ///< Asked between frames; may be empty.
};

/// Watches a source and tells whether the laser fires in every second exposure, and in which.
///
/// Each exposure is compared with the next (fields: interpolated to the same lines): a stripe is
/// whatever in one of the two stands out narrowly along its column far above what stands out in the
/// other. Light that both share cancels. The source is started and stopped.
///
/// @throws Error what the source's `start` throws.
SyncReport check_sync(FrameSource& source, const SyncCheckOptions& options = {});

}  // namespace striper
