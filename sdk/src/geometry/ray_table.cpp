// SPDX-License-Identifier: Apache-2.0
#include "geometry/ray_table.hpp"

#include <algorithm>
#include <limits>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace striper::detail {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kCoarsestStepPx = 64.0;
constexpr int kCheckedLines = 17;

Eigen::Vector2d pixel_of(StripeAxis axis, double along_px, double across_px) {
  return axis == StripeAxis::kColumns ? Eigen::Vector2d(along_px, across_px)
                                      : Eigen::Vector2d(across_px, along_px);
}

}  // namespace

RayTable::Segment RayTable::none() noexcept {
  Segment segment{};
  segment.x_[0] = kNan;
  segment.y_[0] = kNan;
  return segment;
}

RayTable::RayTable(const CameraModel& camera, StripeAxis axis, const AxisGrid& along,
                   int line_count)
    : axis_(axis),
      along_(along),
      line_count_(line_count),
      last_px_(axis == StripeAxis::kColumns ? camera.height() : camera.width()) {
  double step_px = kCoarsestStepPx;
  fill(camera, step_px);
  while (step_px > 1.0 && worst_error_px(camera) > kTolerancePx) {
    step_px *= 0.5;
    fill(camera, step_px);
  }
}

RayTable::Node RayTable::exact_node(const CameraModel& camera, int line, double across_px,
                                    double step_px) const {
  const Unprojection ray = camera.unproject(pixel_of(axis_, along_.sensor(line), across_px));
  if (ray.status != CameraStatus::kOk) return {kNan, kNan, kNan, kNan};
  Eigen::Matrix<double, 2, 3> J_point;
  camera.project(ray.xy.homogeneous(), &J_point, nullptr);
  const Eigen::Matrix2d dxy_dpixel = J_point.leftCols<2>().inverse();
  const Eigen::Vector2d slope = step_px * dxy_dpixel.col(axis_ == StripeAxis::kColumns ? 1 : 0);
  return {ray.xy.x(), ray.xy.y(), slope.x(), slope.y()};
}

void RayTable::fill(const CameraModel& camera, double step_px) {
  nodes_per_line_ = static_cast<std::int64_t>(std::ceil((last_px_ - first_px_) / step_px)) + 1;
  segments_ = static_cast<double>(nodes_per_line_ - 1);
  inverse_step_ = 1.0 / step_px;
  nodes_.resize(static_cast<std::size_t>(line_count_ * nodes_per_line_));
  for (int line = 0; line < line_count_; ++line) {
    for (std::int64_t k = 0; k < nodes_per_line_; ++k) {
      const double across_px = first_px_ + step_px * static_cast<double>(k);
      nodes_[static_cast<std::size_t>(line * nodes_per_line_ + k)] =
          exact_node(camera, line, across_px, step_px);
    }
  }
}

// The error is largest near the middle of a segment. Pixels, by the lens' own scale at that place.
double RayTable::worst_error_px(const CameraModel& camera) const {
  double worst = 0.0;
  const double step_px = 1.0 / inverse_step_;
  for (int i = 0; i < std::min(kCheckedLines, line_count_); ++i) {
    const int line = kCheckedLines >= line_count_ ? i : i * (line_count_ - 1) / (kCheckedLines - 1);
    for (std::int64_t k = 0; k + 1 < nodes_per_line_; ++k) {
      const double across_px = first_px_ + step_px * (static_cast<double>(k) + 0.5);
      const Segment segment = at(line, across_px);
      if (!segment.exists()) continue;
      const Projection back = camera.project(segment.xy().homogeneous());
      if (back.status != CameraStatus::kOk) continue;
      const Eigen::Vector2d truth = pixel_of(axis_, along_.sensor(line), across_px);
      worst = std::max(worst, (back.pixel - truth).norm());
    }
  }
  return worst;
}

}  // namespace striper::detail
