// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/profile/segment_options.hpp>

namespace striper {

void SegmentOptions::validate() const {
  if (!(false_split_rate >= 1e-6 && false_split_rate <= 0.1)) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("false_split_rate is {}; expected 1e-6 to 0.1", false_split_rate));
  }
  if (!pivot_m.allFinite()) {
    throw Error(ErrorKind::kBadValue, fmt::format("pivot_m is {}, {}; expected finite numbers",
                                                  pivot_m.x(), pivot_m.y()));
  }
}

Eigen::Vector2d noise_pivot(const StriperModel& model, int laser) {
  const Eigen::Isometry3d T_cam_scan = model.T_cam_scan(laser);
  const LaserPlane& plane = model.lasers[static_cast<std::size_t>(laser)].plane;
  const Eigen::Vector3d axis =
      model.axis == StripeAxis::kColumns ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
  const double facing = plane.normal().dot(axis);
  constexpr double kParallel = 1e-3;
  if (std::abs(facing) < kParallel) return Eigen::Vector2d::Zero();
  return (T_cam_scan.inverse() * (plane.distance_m() / facing * axis)).head<2>();
}

SegmentOptions options_for(const StriperModel* model, int laser, SegmentOptions options) {
  const bool is_known = model != nullptr && laser < static_cast<int>(model->lasers.size());
  if (is_known) options.pivot_m = noise_pivot(*model, laser);
  return options;
}

// The largest gain of a cut is a maximum of chi2 over its places, so its logarithmic tail is nearly
// straight; the three numbers are read from 200000 scans each of 160 and 640 returns, and of 640 of
// which 2 % are gross outliers, which are cut twice as often as without.
double piece_penalty(double false_split_rate, std::size_t points) {
  constexpr double kAtOneInThousand = 23.6;
  constexpr double kByRate = 2.45;
  constexpr double kByPoints = 1.23;
  const double n = std::max(static_cast<double>(points), 10.0);
  return kAtOneInThousand + kByPoints * std::log(n / 640.0) -
         kByRate * std::log(false_split_rate / 1e-3);
}

}  // namespace striper
