// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace striper {

/// How a vehicle has moved, at one moment: along its own path, forwards positive, and turned
/// counter-clockwise from above, both since the first reading. NaN where it is not known. Each
/// figure has its one-sigma error beside it; those of distance and yaw are of all that came since
/// the first reading, and so grow with it.
struct Motion {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  double time_s = kUnknown;  ///< On the scans' clock: `FrameTime::seconds()`.
  double distance_m = kUnknown;
  double speed_m_s = kUnknown;
  double yaw_rad = kUnknown;  ///< Not wrapped: a full turn is 2 pi.
  double yaw_rate_rad_s = kUnknown;

  double sigma_distance_m = kUnknown;
  double sigma_speed_m_s = kUnknown;
  double sigma_yaw_rad = kUnknown;
  double sigma_yaw_rate_rad_s = kUnknown;
};

}  // namespace striper
