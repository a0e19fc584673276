// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <striper/scan/polar_scan.hpp>

namespace striper::testing {

/// The strongest published rule for one scan, as the baseline: a return is on a curb where the mean
/// vectors to its 15 neighbours on either side meet at 100 to 160 degrees and those neighbours
/// differ in height by enough (Zhang, Wang, Wang & Dolan, IEEE T-ITS 2018, eqs. 2 to 5; there .1 m
/// for a turning lidar, here the caller's). @return the first such return outwards, (lateral,
/// height) from the sensor, upright by `up_rad`; none where there is no such.
inline std::optional<Eigen::Vector2d> zhang_curb(const PolarScan& scan, double up_rad,
                                                 double min_height_m) {
  constexpr std::ptrdiff_t kNeighbours = 15;
  constexpr double kDegree = std::numbers::pi / 180.0;
  const Eigen::Vector2d up(std::cos(up_rad), std::sin(up_rad));
  const Eigen::Vector2d out(up.y(), -up.x());
  std::vector<Eigen::Vector2d> points;
  for (const Return& r : scan.returns) {
    if (r.status != ReturnStatus::kOk) continue;
    const Eigen::Vector2d p =
        r.range_m * Eigen::Vector2d(std::cos(r.bearing_rad), std::sin(r.bearing_rad));
    points.emplace_back(p.dot(out), p.dot(up));
  }
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return a.x() < b.x(); });
  for (std::ptrdiff_t i = kNeighbours; i + kNeighbours < std::ssize(points); ++i) {
    const auto at = [&](std::ptrdiff_t k) { return points[static_cast<std::size_t>(k)]; };
    Eigen::Vector2d before = Eigen::Vector2d::Zero();
    Eigen::Vector2d after = Eigen::Vector2d::Zero();
    double low = at(i).y();
    double high = low;
    for (std::ptrdiff_t k = 1; k <= kNeighbours; ++k) {
      before += at(i - k) - at(i);
      after += at(i + k) - at(i);
      low = std::min({low, at(i - k).y(), at(i + k).y()});
      high = std::max({high, at(i - k).y(), at(i + k).y()});
    }
    const double angle =
        std::acos(std::clamp(before.normalized().dot(after.normalized()), -1.0, 1.0));
    const bool is_bent = angle > 100.0 * kDegree && angle < 160.0 * kDegree;
    if (is_bent && high - low >= min_height_m) return at(i);
  }
  return std::nullopt;
}

}  // namespace striper::testing
