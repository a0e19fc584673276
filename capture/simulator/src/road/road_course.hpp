// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include <striper/road/road.hpp>

namespace striper::detail {

/// Where the truck is and how it stands.
struct TruckPose {
  Eigen::Vector2d place_m{0.0, 0.0};
  double heading_rad = 0.0;
};

/// A place beside the road's course.
struct BesideRoad {
  double along_m = 0.0;
  double lateral_m = 0.0;
};

/// The road's course as a curve, and the truck's way beside it, by time and distance.
class RoadCourse {
 public:
  explicit RoadCourse(const Road& road);

  double duration_s() const noexcept { return time_s_.back(); }
  double way_m() const noexcept { return way_.back(); }
  /// Along the course, of the truck's reference.
  double along_at_time(double time_s) const noexcept;
  double along_at_way(double distance_m) const noexcept;
  double time_at_along(double along_m) const noexcept { return at(time_s_, along_m); }
  double way_at_along(double along_m) const noexcept { return at(way_, along_m); }
  double curvature_of_way(double along_m) const noexcept;  ///< 1 / m, of the truck's.

  TruckPose pose(double along_m) const noexcept;
  /// A point of the truck's frame, beside the road.
  BesideRoad beside(const TruckPose& pose, const Eigen::Vector2d& in_truck_m,
                    double near_along_m) const noexcept;
  /// Where what runs `lateral_m` beside the course crosses x in the truck's frame.
  double lateral_in_truck(double along_m, double x_m, double lateral_m) const noexcept;

 private:
  double at(const std::vector<double>& values, double along_m) const noexcept;
  Eigen::Vector2d point(double along_m) const noexcept;
  double angle(double along_m) const noexcept { return at(angle_rad_, along_m); }
  double offset_m(double along_m) const noexcept;
  double offset_slope(double along_m) const noexcept;

  Road road_;
  double start_m_ = 0.0;  // The grid begins behind the truck.
  std::vector<double> x_m_;
  std::vector<double> y_m_;
  std::vector<double> angle_rad_;
  std::vector<double> way_;  // Of the truck, from the start.
  std::vector<double> time_s_;
};

}  // namespace striper::detail
