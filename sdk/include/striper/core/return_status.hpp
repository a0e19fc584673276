// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace striper {

/// Why a column's return is good, doubtful or missing: the CSV's `status` column. The numbers are
/// those of messages and point files and never change; new ones are appended.
enum class ReturnStatus : std::uint8_t {
  // Good.
  kOk = 0,
  // Doubtful: the values are there, and there is a reason to distrust them.
  kSaturated = 1,  ///< So many clipped pixels that the centre is not known to a pixel.
  kAmbiguous = 2,  ///< Another peak is about as likely.
  kWide = 3,  ///< Wider than the stripe is: a light source, a specular highlight, a bright surface.
  kNarrow = 4,      ///< Narrower than the stripe can be: a hot pixel.
  kWeak = 5,        ///< Below the signal-to-noise gate.
  kEdge = 6,        ///< So near the image's border that part of the stripe is outside.
  kOutOfRange = 7,  ///< Triangulates to a range outside the limits that were set.
  // Missing: there is no range.
  kNoStripe = 8,       ///< Nothing above the threshold.
  kBlind = 9,          ///< Ambient light saturates pixels where the stripe may hide.
  kBehind = 10,        ///< The ray does not meet the laser plane in front of the camera.
  kOutsideModel = 11,  ///< The camera model is not defined at this pixel.
  // Doubtful again.
  kFilled = 12,  ///< Nothing was measured here: between the ends of a gap that was filled.
  kOutlier =
      13,  ///< Probably something else than the stripe: its confidence is too low, or nothing
           ///< beside it supports it.
};

inline constexpr int kReturnStatusCount = 14;

enum class Verdict { kGood, kDoubtful, kMissing };

/// Good, doubtful (has values) or missing (has none).
Verdict verdict(ReturnStatus status) noexcept;

/// The word for the CSV: `ok`, `no_stripe`, ... Static storage.
std::string_view to_string(ReturnStatus status) noexcept;

/// The inverse of `to_string`; empty for a word that is none of them.
std::optional<ReturnStatus> return_status_from_string(std::string_view word) noexcept;

}  // namespace striper
