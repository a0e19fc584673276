// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/stream/messages/scan_messages.hpp>

namespace striper {

LaserScanGrid make_laser_scan_grid(const StriperModel& model, int laser, const PixelGrid& pixels,
                                   cv::Size size, double range_min_m, double range_max_m) {
  const Triangulator triangulator(model, laser);
  double least = std::numeric_limits<double>::infinity();
  double greatest = -least;
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      const PlanePoint point =
          triangulator.triangulate({pixels.sensor_u(column), pixels.sensor_v(row)});
      if (point.status != ReturnStatus::kOk) continue;
      if (point.range_m() < range_min_m || point.range_m() > range_max_m) continue;
      least = std::min(least, point.bearing_rad());
      greatest = std::max(greatest, point.bearing_rad());
    }
  }
  const int lines = model.axis == StripeAxis::kColumns ? size.width : size.height;
  if (!(greatest > least) || lines < 2) {
    throw Error(ErrorKind::kUntrustworthy,
                fmt::format("no pixel sees the plane of laser {} from {} to {} m: there are no "
                            "bearings for a LaserScan",
                            laser, range_min_m, range_max_m));
  }
  return {least, greatest, lines, range_min_m, range_max_m};
}

LaserScans::LaserScans(const StriperModel& model) {
  const cv::Size size(model.camera.width(), model.camera.height());
  for (std::size_t laser = 0; laser < model.lasers.size(); ++laser) {
    makers_.emplace_back();
    try {
      makers_.back().emplace(
          make_laser_scan_grid(model, static_cast<int>(laser), PixelGrid{}, size));
    } catch (const Error&) {  // No pixel sees it.
    }
  }
}

bool LaserScans::to_message(const PolarScan& scan, wire::LaserScan& message) {
  const auto laser = static_cast<std::size_t>(scan.laser);
  if (laser >= makers_.size() || !makers_[laser]) return false;
  makers_[laser]->to_message(scan, message);
  return true;
}

}  // namespace striper
