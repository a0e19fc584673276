// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "support/profile_scans.hpp"

namespace striper::testing {

/// The ground across the road: points (lateral, height) joined by straight lines, outwards.
using RoadProfile = std::vector<Eigen::Vector2d>;

/// A striper over the road that looks aside and down; lateral grows with x of the scan.
struct RoadStriper {
  ProfileStriper striper{};
  double height_m = 0.5;
  double down_rad = 28.0 * std::numbers::pi / 180.0;
  double roll_rad = 0.0;  ///< Of the whole vehicle.

  double up_rad() const { return 0.5 * std::numbers::pi + down_rad; }
};

/// The range of one ray to the nearest of a profile's lines; NaN where it meets none.
inline double range_of_profile(const RoadStriper& road, const RoadProfile& profile,
                               double bearing_rad) {
  const double elevation = bearing_rad - road.down_rad - road.roll_rad;
  const Eigen::Vector2d ray(std::cos(elevation), std::sin(elevation));
  const Eigen::Vector2d sensor(0.0, road.height_m);
  double nearest = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 0; k + 1 < profile.size(); ++k) {
    const Eigen::Vector2d along = profile[k + 1] - profile[k];
    const Eigen::Vector2d to = profile[k] - sensor;
    const double det = ray.x() * along.y() - ray.y() * along.x();
    if (std::abs(det) < 1e-12) continue;
    const double range = (to.x() * along.y() - to.y() * along.x()) / det;
    const double part = (to.x() * ray.y() - to.y() * ray.x()) / det;
    if (range <= 0.0 || part < 0.0 || part > 1.0) continue;
    if (!(range >= nearest)) nearest = range;
  }
  return nearest;
}

inline std::vector<double> ranges_of_profile(const RoadStriper& road, const RoadProfile& profile) {
  return exact_ranges(road.striper, [&](double b) { return range_of_profile(road, profile, b); });
}

/// A road with a curb: foot at `lateral_m`, the face leaning back by `batter_rad`.
inline RoadProfile curb_profile(double lateral_m, double height_m, double batter_rad = 0.0) {
  const double edge = lateral_m + height_m * std::tan(batter_rad);
  return {{-1.0, 0.0}, {lateral_m, 0.0}, {edge, height_m}, {edge + 6.0, height_m}};
}

/// Fresh noise on it; the scan's axis is rows.
inline void road_scan(const RoadStriper& road, const std::vector<double>& ranges, PolarScan& scan) {
  noisy_scan(road.striper, ranges, scan);
  scan.axis = StripeAxis::kRows;
}

}  // namespace striper::testing
