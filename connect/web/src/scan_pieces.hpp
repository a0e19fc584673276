// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include <striper/profile/segments.hpp>

namespace striper::detail {

/// The straight pieces of the newest scans, for who asks: scans are kept while somebody does.
/// Thread-safe.
class ScanPieces {
 public:
  void see(const PolarScan& scan);

  /// `/api/v1/pieces`: {sequence, pieces[{x1_m, y1_m, x2_m, y2_m, sigma_m, points, is_rough}]}, the
  /// scan frame; sigma_m of the line's offset in its middle. The first answer has none: sequence
  /// null.
  std::string json(const std::string& head, int laser);

 private:
  using Clock = std::chrono::steady_clock;
  struct Kept {
    Clock::time_point asked;
    PolarScan scan;
    bool is_there = false;
  };

  std::mutex mutex_;
  std::map<std::pair<std::string, int>, Kept> kept_;  // By head and laser.
  Segmenter segmenter_;
  Segmentation segmentation_;
};

}  // namespace striper::detail
