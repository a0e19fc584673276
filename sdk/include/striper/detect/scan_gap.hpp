// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace striper {

/// Tracks of curbs and objects bridge no longer time between two scans of a plane.
inline constexpr double kLongestScanGap_s = 1.0;

/// Whether tracks go on from one scan of a plane to the next; else they begin anew.
/// @param passed_s between the two.
constexpr bool do_tracks_go_on(double passed_s) noexcept {
  return passed_s > 0.0 && passed_s <= kLongestScanGap_s;
}

}  // namespace striper
