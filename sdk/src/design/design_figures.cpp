// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include <striper/design/design_figures.hpp>

#include "stripe/candidates/detection.hpp"

namespace striper {
namespace {

constexpr double kNearest_m = 0.01;
constexpr double kFarthest_m = 1000.0;
constexpr double kRangeStep = 1.01;  // Of the search for limits, which are then halved down.

StriperDesign validated(StriperDesign design) {
  design.validate();
  return design;
}

double threshold_of(const StriperDesign& design) {
  const bool is_column = design.model.axis == StripeAxis::kColumns;
  const int pixels = is_column ? design.model.camera.height() : design.model.camera.width();
  const bool is_field = design.camera.interlaced && is_column;
  detail::Detection detection;
  detection.prepare(is_field ? pixels / 2 : pixels, design.false_alarm, design.false_alarm);
  return detection.threshold();
}

// Where a predicate changes between two values, the one at which it still holds.
template <typename Predicate>
double boundary(double holds, double fails, Predicate predicate) {
  for (int n = 0; n < 60; ++n) {
    const double middle = 0.5 * (holds + fails);
    (predicate(middle) ? holds : fails) = middle;
  }
  return holds;
}

Eigen::Vector3d point_cam(const Triangulator& triangulator, double range_m, double bearing_rad) {
  return triangulator.T_cam_scan() *
         Eigen::Vector3d(range_m * std::cos(bearing_rad), range_m * std::sin(bearing_rad), 0.0);
}

double angle_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return std::atan2(a.homogeneous().cross(b.homogeneous()).norm(),
                    a.homogeneous().dot(b.homogeneous()));
}

}  // namespace

DesignFigures::DesignFigures(StriperDesign design)
    : design_(validated(std::move(design))),
      triangulator_(design_.model, design_.laser_index),
      threshold_sigmas_(threshold_of(design_)) {
  const auto seen = [&](double range_m) { return is_seen(range_m, 0.0); };
  double last_m = RangeFigures::kNone;
  for (double range_m = kNearest_m; range_m <= kFarthest_m; range_m *= kRangeStep) {
    if (!seen(range_m)) continue;
    if (std::isnan(near_m_))
      near_m_ = range_m > kNearest_m ? boundary(range_m, range_m / kRangeStep, seen) : range_m;
    last_m = range_m;
  }
  if (std::isnan(last_m)) return;
  const bool is_horizon = last_m * kRangeStep > kFarthest_m;
  far_m_ = is_horizon ? std::numeric_limits<double>::infinity()
                      : boundary(last_m, last_m * kRangeStep, seen);
}

int DesignFigures::line_pitch() const noexcept {
  return design_.camera.interlaced && design_.model.axis == StripeAxis::kColumns ? 2 : 1;
}

bool DesignFigures::is_seen(double range_m, double bearing_rad) const {
  const Projection seen =
      triangulator_.project(range_m * std::cos(bearing_rad), range_m * std::sin(bearing_rad));
  if (seen.status != CameraStatus::kOk) return false;
  const CameraModel& camera = design_.model.camera;
  return seen.pixel.x() >= -0.5 && seen.pixel.x() <= camera.width() - 0.5 &&
         seen.pixel.y() >= -0.5 && seen.pixel.y() <= camera.height() - 0.5;
}

bool DesignFigures::is_lit(const Eigen::Vector3d& p_cam) const {
  const Eigen::Vector3d ray = (p_cam - design_.laser.origin_cam).normalized();
  const double angle = std::acos(std::clamp(ray.dot(design_.laser.axis_cam), -1.0, 1.0));
  return angle <= 0.5 * design_.laser.fan_rad + 1e-9;
}

RangeFigures DesignFigures::at(double range_m, double bearing_rad) const {
  RangeFigures figures;
  figures.range_m = range_m;
  if (!(range_m > 0.0) || !std::isfinite(range_m) || !is_seen(range_m, bearing_rad)) return figures;
  const Eigen::Vector2d pixel =
      triangulator_.project(range_m * std::cos(bearing_rad), range_m * std::sin(bearing_rad)).pixel;
  add_steps(pixel, figures);
  if (is_lit(point_cam(triangulator_, range_m, bearing_rad))) add_errors(pixel, figures);
  return figures;
}

void DesignFigures::add_steps(const Eigen::Vector2d& pixel, RangeFigures& figures) const {
  const int across = design_.model.axis == StripeAxis::kColumns ? 1 : 0;
  const PlanePoint here = triangulator_.triangulate(pixel);
  if (here.status != ReturnStatus::kOk) return;
  const Eigen::Vector2d radial(here.x_m / here.range_m(), here.y_m / here.range_m());
  const double slope = radial.dot(triangulator_.gradient(pixel).d_pixel.col(across));
  figures.step_derivative_m = std::abs(slope) * line_pitch();
  Eigen::Vector2d outward = pixel;
  outward[across] += std::copysign(line_pitch(), slope);
  const PlanePoint next = triangulator_.triangulate(outward);
  figures.step_out_m = next.status == ReturnStatus::kOk ? next.range_m() - here.range_m()
                                                        : std::numeric_limits<double>::infinity();
}

double DesignFigures::angular_resolution_rad() const {
  const CameraModel& camera = design_.model.camera;
  const Eigen::Vector2d middle(0.5 * (camera.width() - 1), 0.5 * (camera.height() - 1));
  const Eigen::Vector2d half = design_.model.axis == StripeAxis::kColumns
                                   ? Eigen::Vector2d(0.5, 0.0)
                                   : Eigen::Vector2d(0.0, 0.5);
  return angle_between(camera.unproject(middle - half).xy, camera.unproject(middle + half).xy);
}

double DesignFigures::edge_bearing_rad(double range_m, double sign) const {
  const auto shown = [&](double bearing_rad) {
    return is_seen(range_m, sign * bearing_rad) &&
           is_lit(point_cam(triangulator_, range_m, sign * bearing_rad));
  };
  if (!shown(0.0)) return RangeFigures::kNone;
  constexpr double kStep_rad = 0.002;
  double bearing_rad = 0.0;
  while (bearing_rad < std::numbers::pi && shown(bearing_rad + kStep_rad)) bearing_rad += kStep_rad;
  return boundary(bearing_rad, bearing_rad + kStep_rad, shown);
}

double DesignFigures::coverage_rad(double range_m) const {
  return edge_bearing_rad(range_m, 1.0) + edge_bearing_rad(range_m, -1.0);
}

double DesignFigures::max_range_m() const {
  const auto found = [&](double range_m) { return at(range_m).detection >= design_.detection; };
  double last_m = RangeFigures::kNone;
  for (double range_m = near_m_; range_m <= std::min(far_m_, kFarthest_m); range_m *= 1.03)
    if (found(range_m)) last_m = range_m;
  if (std::isnan(last_m)) return last_m;
  return std::min(far_m_, boundary(last_m, 1.03 * last_m, found));
}

double DesignFigures::shutter_factor() const noexcept {
  return 1.0 / (design_.camera.rate_hz * design_.camera.shutter_s);
}

double DesignFigures::filter_factor() const noexcept {
  return design_.sun.total_w_m2 / design_.sun.filtered_w_m2(design_.camera.filter_width_nm);
}

double DesignFigures::scan_rate_hz() const noexcept {
  const DesignCamera& camera = design_.camera;
  return camera.rate_hz * (camera.interlaced ? 2.0 : 1.0) / (camera.dark_subtracted ? 2.0 : 1.0);
}

}  // namespace striper
