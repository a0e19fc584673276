// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace striper::detail {

/// Learns how worn a stripe's edges are from its widths, beam by beam.
///
/// Of edges that wear independently with variance v each, a width has 2 v and a middle v / 2. Over
/// a distance d alike wear correlates by exp(-d / length): widths of one beam one after the other
/// show that too.
class WearEstimate {
 public:
  static constexpr std::size_t kMostBeams = 8;

  WearEstimate(double sigma_m, double length_m) noexcept;

  /// @param sigma_m of the middle from noise; @param distance_m where the beam meets the road.
  void add(std::size_t beam, double width_m, double sigma_m, double distance_m) noexcept;

  double sigma_m() const noexcept;  ///< Of the middle.
  double length_m() const noexcept { return length_m_; }
  double width_m() const noexcept { return width_m_; }  ///< Mean; NaN before the first.

 private:
  struct Last {
    double width_m = 0.0;
    double distance_m = 0.0;
    bool is_known = false;
  };
  std::array<Last, kMostBeams> last_{};
  double start_variance_;  // Of the middle.
  double length_m_;
  double width_m_;
  double way_m_ = 0.0;     // That widths were learnt over.
  double variance_ = 0.0;  // Of widths, without noise.
  double together_ = 0.0;  // Products of two widths in a row, where they are near each other.
  double near_variance_ = 0.0;
  double near_m_ = 0.0;
};

}  // namespace striper::detail
