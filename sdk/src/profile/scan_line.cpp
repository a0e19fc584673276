// SPDX-License-Identifier: Apache-2.0
#include "profile/scan_line.hpp"

#include <cmath>
#include <numbers>

#include <striper/profile/segments.hpp>

namespace striper {

Eigen::Vector2d ScanLine::normal() const { return {std::cos(angle_rad), std::sin(angle_rad)}; }

Eigen::Vector2d ScanLine::direction() const { return {-std::sin(angle_rad), std::cos(angle_rad)}; }

double ScanLine::offset_m(const Eigen::Vector2d& p_scan) const {
  return normal().dot(p_scan) - distance_m;
}

double ScanLine::offset_variance_m2(const Eigen::Vector2d& p_scan) const {
  const Eigen::Vector2d gradient(direction().dot(p_scan), -1.0);
  return gradient.dot(covariance * gradient);
}

namespace detail {

ScanLine scan_line(const LineFit& fit, double scale, const Eigen::Vector2d& pivot_m) noexcept {
  const Eigen::Vector2d& p = fit.parameters;
  const double h = p.norm();
  const Eigen::Vector2d normal = p / h;
  const Eigen::Vector2d along(-normal.y(), normal.x());
  ScanLine line;
  line.angle_rad = std::atan2(normal.y(), normal.x());
  line.distance_m = 1.0 / h + normal.dot(pivot_m);
  Eigen::Matrix2d d;  // Of angle and distance by p.
  d.row(0) = along.transpose() / h;
  d.row(1) = -normal.transpose() / (h * h) + along.dot(pivot_m) * d.row(0);
  if (line.distance_m < 0.0) {  // The pivot and the origin are on different sides.
    line.distance_m = -line.distance_m;
    line.angle_rad = std::remainder(line.angle_rad + std::numbers::pi, 2.0 * std::numbers::pi);
    d.row(1) = -d.row(1);
  }
  line.covariance = scale * scale * (d * fit.covariance * d.transpose());
  return line;
}

}  // namespace detail
}  // namespace striper
