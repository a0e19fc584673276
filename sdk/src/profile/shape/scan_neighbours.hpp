// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <striper/scan/polar_scan.hpp>

namespace striper::detail {

/// The returns of a scan that have a surface, in their order, and which of them are on one surface
/// with the next.
///
/// A scan of all scan lines says by place what is between two returns. A table of the ok ones alone
/// says it by their pixels along the stripe, of which the scan lines are whole multiples; where
/// these do not tell (there are none, or those of a scan that was resampled) all are neighbours.
class ScanNeighbours {
 public:
  /// @throws Error{kUsage} where a scan line has several returns: which goes on is not known.
  explicit ScanNeighbours(const PolarScan& scan);

  std::size_t size() const { return good_.size(); }
  const Return& at(std::size_t k) const { return scan_.returns[good_[k]]; }

  /// How far return k is from the next one.
  double distance_m(std::size_t k) const;

  /// Whether a scan line between k and the next has no surface, or they are farther apart than
  /// three times what is usual: what those beside them are where the surface goes on as straight,
  /// or what the scan's rays usually are apart at their range.
  bool is_gap(std::size_t k) const;

 private:
  void find_pitch();
  double apart_px(std::size_t k) const;
  bool are_neighbours(std::size_t k) const;
  double turn_rad(std::size_t k) const;
  double usual_m(std::size_t k) const;
  bool goes_on(std::size_t k, std::size_t other) const;

  const PolarScan& scan_;
  std::vector<std::size_t> good_;
  std::optional<double> pitch_px_;
  double usual_turn_rad_ = 0.0;
};

}  // namespace striper::detail
