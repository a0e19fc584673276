// SPDX-License-Identifier: Apache-2.0
#include "road/road_course.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace striper::detail {
namespace {

constexpr double kStep_m = 0.05;
// The course is known so far behind the start and beyond the end: beams look there.
constexpr double kBeyond_m = 60.0;
constexpr double kTwoPi = 2.0 * std::numbers::pi;

double curvature_at(const Road& road, double along_m) {
  double begin_m = 0.0;
  double before = 0.0;
  for (const RoadBend& bend : road.course) {
    const double curvature = bend.radius_m == 0.0 ? 0.0 : 1.0 / bend.radius_m;
    const double in_m = along_m - begin_m;
    if (in_m >= 0.0 && in_m < bend.length_m) {
      const double share = in_m < bend.transition_m ? in_m / bend.transition_m : 1.0;
      return before + share * (curvature - before);
    }
    begin_m += bend.length_m;
    before = curvature;
  }
  return 0.0;
}

double speed_at(const Road& road, double along_m) {
  double speed_m_s = road.speeds.front().speed_m_s;
  for (const RoadSpeed& speed : road.speeds) {
    if (along_m >= speed.at_m) speed_m_s = speed.speed_m_s;
  }
  return speed_m_s;
}

}  // namespace

RoadCourse::RoadCourse(const Road& road) : road_(road), start_m_(-kBeyond_m) {
  const auto count = static_cast<std::size_t>((road.length_m + 2.0 * kBeyond_m) / kStep_m) + 2;
  double x_m = 0.0;
  double y_m = 0.0;
  double angle_rad = 0.0;
  double way_m = 0.0;
  double time_s = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double along_m = start_m_ + static_cast<double>(i) * kStep_m;
    x_m_.push_back(x_m);
    y_m_.push_back(y_m);
    angle_rad_.push_back(angle_rad);
    way_.push_back(way_m);
    time_s_.push_back(time_s);
    const double middle_m = along_m + 0.5 * kStep_m;
    const double curvature = curvature_at(road, middle_m);
    const double half_rad = angle_rad + 0.5 * curvature * kStep_m;
    x_m += kStep_m * std::cos(half_rad);
    y_m += kStep_m * std::sin(half_rad);
    angle_rad += curvature * kStep_m;
    const double step_m =
        kStep_m * std::hypot(1.0 - curvature * offset_m(middle_m), offset_slope(middle_m));
    if (middle_m < 0.0 || middle_m > road.length_m) continue;
    way_m += step_m;
    time_s += step_m / speed_at(road, middle_m);
  }
}

double RoadCourse::offset_m(double along_m) const noexcept {
  double sum_m = 0.0;
  for (const RoadWander& one : road_.wander) {
    sum_m += one.amplitude_m * std::sin(kTwoPi * along_m / one.period_m + one.phase_rad);
  }
  return sum_m;
}

double RoadCourse::offset_slope(double along_m) const noexcept {
  double sum = 0.0;
  for (const RoadWander& one : road_.wander) {
    const double rate = kTwoPi / one.period_m;
    sum += one.amplitude_m * rate * std::cos(rate * along_m + one.phase_rad);
  }
  return sum;
}

double RoadCourse::at(const std::vector<double>& values, double along_m) const noexcept {
  const double cell =
      std::clamp((along_m - start_m_) / kStep_m, 0.0, static_cast<double>(values.size()) - 1.001);
  const auto i = static_cast<std::size_t>(cell);
  const double share = cell - static_cast<double>(i);
  return values[i] + share * (values[i + 1] - values[i]);
}

Eigen::Vector2d RoadCourse::point(double along_m) const noexcept {
  return {at(x_m_, along_m), at(y_m_, along_m)};
}

double RoadCourse::along_at_time(double time_s) const noexcept {
  const auto next = std::upper_bound(time_s_.begin(), time_s_.end(), time_s);
  if (next == time_s_.end()) return road_.length_m;
  if (next == time_s_.begin()) return 0.0;
  const auto i = static_cast<std::size_t>(next - time_s_.begin()) - 1;
  const double share = (time_s - time_s_[i]) / (time_s_[i + 1] - time_s_[i]);
  return start_m_ + (static_cast<double>(i) + share) * kStep_m;
}

double RoadCourse::along_at_way(double distance_m) const noexcept {
  const auto next = std::upper_bound(way_.begin(), way_.end(), distance_m);
  if (next == way_.end()) return road_.length_m + distance_m - way_.back();
  if (next == way_.begin()) return distance_m;
  const auto i = static_cast<std::size_t>(next - way_.begin()) - 1;
  const double share = (distance_m - way_[i]) / (way_[i + 1] - way_[i]);
  return start_m_ + (static_cast<double>(i) + share) * kStep_m;
}

TruckPose RoadCourse::pose(double along_m) const noexcept {
  const double angle_rad = angle(along_m);
  const double offset = offset_m(along_m);
  const Eigen::Vector2d normal(-std::sin(angle_rad), std::cos(angle_rad));
  const double slope = offset_slope(along_m) / (1.0 - curvature_at(road_, along_m) * offset);
  return {point(along_m) + offset * normal, angle_rad + std::atan(slope)};
}

double RoadCourse::curvature_of_way(double along_m) const noexcept {
  constexpr double kHalf_m = 0.1;
  const double turn_rad = pose(along_m + kHalf_m).heading_rad - pose(along_m - kHalf_m).heading_rad;
  return turn_rad / (2.0 * kHalf_m);
}

BesideRoad RoadCourse::beside(const TruckPose& pose, const Eigen::Vector2d& in_truck_m,
                              double near_along_m) const noexcept {
  const double c = std::cos(pose.heading_rad);
  const double s = std::sin(pose.heading_rad);
  const Eigen::Vector2d place =
      pose.place_m + Eigen::Vector2d(c * in_truck_m.x() - s * in_truck_m.y(),
                                     s * in_truck_m.x() + c * in_truck_m.y());
  double along_m = near_along_m;
  double lateral_m = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double angle_rad = angle(along_m);
    const Eigen::Vector2d off = place - point(along_m);
    const double forward_m = off.x() * std::cos(angle_rad) + off.y() * std::sin(angle_rad);
    lateral_m = -off.x() * std::sin(angle_rad) + off.y() * std::cos(angle_rad);
    along_m += forward_m / (1.0 - curvature_at(road_, along_m) * lateral_m);
  }
  return {along_m, lateral_m};
}

double RoadCourse::lateral_in_truck(double along_m, double x_m, double lateral_m) const noexcept {
  const TruckPose truck = pose(along_m);
  const double c = std::cos(truck.heading_rad);
  const double s = std::sin(truck.heading_rad);
  double at_m = along_m + x_m;
  double left_m = 0.0;
  for (int i = 0; i < 4; ++i) {
    const double angle_rad = angle(at_m);
    const Eigen::Vector2d off =
        point(at_m) + lateral_m * Eigen::Vector2d(-std::sin(angle_rad), std::cos(angle_rad)) -
        truck.place_m;
    const double forward_m = c * off.x() + s * off.y();
    left_m = -s * off.x() + c * off.y();
    at_m += (x_m - forward_m) / std::cos(angle_rad - truck.heading_rad);
  }
  return left_m;
}

}  // namespace striper::detail
