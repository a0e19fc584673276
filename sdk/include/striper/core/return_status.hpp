// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace striper {

/// Why a column's return is good, doubtful or missing: the CSV's `status` column.
enum class ReturnStatus : std::uint8_t {
  // Good.
  kOk,
  // Doubtful: the values are there, and there is a reason to distrust them.
  kSaturated,   ///< So many clipped pixels that the centre is not known to a pixel.
  kAmbiguous,   ///< Another peak is about as likely.
  kWide,        ///< Wider than the stripe is: a lamp, a glint, a bright surface.
  kNarrow,      ///< Narrower than the stripe can be: a hot pixel.
  kWeak,        ///< Below the signal-to-noise gate.
  kOutlier,     ///< Probably something else than the stripe: its confidence is too low.
  kEdge,        ///< So near the image's border that part of the stripe is outside.
  kOutOfRange,  ///< Triangulates to a range outside the limits that were set.
  // Missing: there is no range.
  kNoStripe,      ///< Nothing above the threshold.
  kBlind,         ///< Ambient light saturates pixels where the stripe may hide.
  kBehind,        ///< The ray does not meet the laser plane in front of the camera.
  kOutsideModel,  ///< The camera model is not defined at this pixel.
};

inline constexpr int kReturnStatusCount = 13;

enum class Verdict { kGood, kDoubtful, kMissing };

/// Good, doubtful (has values) or missing (has none).
Verdict verdict(ReturnStatus status) noexcept;

/// The word for the CSV: `ok`, `no_stripe`, ... Static storage.
std::string_view to_string(ReturnStatus status) noexcept;

/// The inverse of `to_string`; empty for a word that is none of them.
std::optional<ReturnStatus> return_status_from_string(std::string_view word) noexcept;

}  // namespace striper
