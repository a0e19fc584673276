// SPDX-License-Identifier: Apache-2.0
#include <striper/ambient/ambient_status.hpp>

namespace striper {

std::string_view to_string(PatternOrigin origin) noexcept {
  switch (origin) {
    case PatternOrigin::kGiven:
      return "given";
    case PatternOrigin::kFrames:
      return "frames";
    case PatternOrigin::kFound:
      return "found";
    case PatternOrigin::kPhase:
      return "phase";
    case PatternOrigin::kAssumed:
      return "assumed";
    case PatternOrigin::kNone:
      break;
  }
  return "none";
}

std::string_view to_string(TrackingPhase phase) noexcept {
  switch (phase) {
    case TrackingPhase::kLocked:
      return "locked";
    case TrackingPhase::kSuspect:
      return "suspect";
    case TrackingPhase::kLost:
      return "lost";
    case TrackingPhase::kGiven:
      return "given";
    case TrackingPhase::kSearching:
      break;
  }
  return "searching";
}

}  // namespace striper
