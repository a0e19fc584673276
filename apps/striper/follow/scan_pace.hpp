// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <striper/detect/scan_gap.hpp>
#include <striper/scan/polar_scan.hpp>

#include "follow/found_tracks.hpp"

namespace striper::program {

/// Whether the times of each plane's scans let tracks go on from one scan to the next.
class ScanPace {
 public:
  void add(const PolarScan& scan) {
    const std::int64_t now_ns = scan.time.monotonic_ns;
    const FoundTracks::Plane key(std::string(scan.head()), scan.laser);
    const auto [place, is_first] = planes_.try_emplace(key, Plane{now_ns});
    if (is_first) return;
    Plane& plane = place->second;
    const auto before_ns = static_cast<double>(std::exchange(plane.last_ns, now_ns));
    const double passed_s = 1e-9 * (static_cast<double>(now_ns) - before_ns);
    ++plane.steps;
    if (do_tracks_go_on(passed_s)) return;
    if (plane.breaks++ == 0) plane.first_break_s = passed_s;
  }

  /// What is wrong with them; empty where the tracks of every plane go on at half of its steps or
  /// more: a recording may have gaps.
  std::string problem() const {
    for (const auto& [key, plane] : planes_) {
      if (2 * plane.breaks <= plane.steps) continue;
      return fmt::format(
          "{} of {} scans of laser {} are {}: no track goes on there - is their time in seconds, "
          "and does it grow?",
          plane.breaks, plane.steps + 1, key.second, plane.break_words());
    }
    return {};
  }

 private:
  struct Plane {
    std::int64_t last_ns = 0;
    std::uint64_t steps = 0;   // From one scan to the next,
    std::uint64_t breaks = 0;  // and those of them at which tracks begin anew.
    double first_break_s = 0.0;

    std::string break_words() const {
      if (!(first_break_s > 0.0)) return "no later than the one before";
      return fmt::format("more than {:g} s later than the one before (the first: {:g} s)",
                         kLongestScanGap_s, first_break_s);
    }
  };
  std::map<FoundTracks::Plane, Plane> planes_;
};

}  // namespace striper::program
