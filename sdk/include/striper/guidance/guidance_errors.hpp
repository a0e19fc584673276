// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include <striper/guidance/guidance_csv.hpp>

namespace striper {

/// Lateral error over a stretch of the way, where there is paint under the gun.
struct LateralErrors {
  double from_m = 0.0;
  double to_m = 0.0;
  std::size_t rows = 0;     ///< That say something, where there is paint.
  std::size_t unknown = 0;  ///< That say nothing, where there is paint.
  double mean_m = std::numeric_limits<double>::quiet_NaN();
  double rms_m = std::numeric_limits<double>::quiet_NaN();
  double largest_m = std::numeric_limits<double>::quiet_NaN();
  double within = std::numeric_limits<double>::quiet_NaN();  ///< Share within `within_m`.
  double pull = std::numeric_limits<double>::quiet_NaN();    ///< rms of error over sigma.
};

/// An end of a dash, and where a gun was switched for it.
struct DashEndError {
  bool is_begin = true;
  double true_m = 0.0;
  double found_m = std::numeric_limits<double>::quiet_NaN();  ///< NaN: no signal near it.

  double error_m() const noexcept { return found_m - true_m; }
};

struct GuidanceErrors {
  std::vector<LateralErrors> stretches;
  LateralErrors all;
  std::vector<DashEndError> ends;  ///< In the order of the road.
  std::size_t invented = 0;        ///< Signals near no end of paint.
};

struct GuidanceErrorOptions {
  double stretch_m = 15.24;  ///< 50 ft, as the report's Figures 21 to 30.
  double within_m = 0.0127;  ///< 1/2 in.
  double from_m = 0.0;       ///< Before it nothing counts: the path begins to be known.
  double near_m = 0.5;       ///< A signal further from an end of paint is for none.
  int line = 0;              ///< Whose ends: that of the gun.
};

/// Holds what guidance said against what is true.
/// @param truth every centimetre, in order. @param guns of one gun, without delays and advances.
/// @throws Error{kBadValue} where there is no truth. Thread-safe.
GuidanceErrors guidance_errors(std::span<const LateralLine> lateral, std::span<const GunLine> guns,
                               std::span<const RoadTruth> truth,
                               const GuidanceErrorOptions& options = {});

}  // namespace striper
