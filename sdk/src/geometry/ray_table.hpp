// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include <striper/core/pixel_grid.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/model/camera_model.hpp>

namespace striper::detail {

/// Undistorted rays of every scan line (column or row) of an image, as a cubic Hermite
/// interpolation across it: a ray in a few nanoseconds where the lens would take hundreds.
/// Immutable; thread-safe.
///
/// Along a scan line the coordinate is exact (there is one row of nodes per scan line); across it
/// the nodes are laid closely enough that the ray is right to `kTolerancePx`, checked on
/// construction against the lens itself.
class RayTable {
 public:
  static constexpr double kTolerancePx = 1e-7;

  /// The rays about one place of a scan line: (x, y, 1) as a cubic of the pixel coordinate across
  /// it. NaN where the camera has no ray, and up to one node from there.
  class Segment {
   public:
    /// The ray `shift_px` away from the place, which may be a pixel outside the segment.
    Eigen::Vector2d xy(double shift_px = 0.0) const noexcept {
      const double s = s_ + shift_px * inverse_step_;
      return {x_[0] + s * (x_[1] + s * (x_[2] + s * x_[3])),
              y_[0] + s * (y_[1] + s * (y_[2] + s * y_[3]))};
    }

    /// Derivative of the ray with respect to the pixel coordinate across the scan line, at the
    /// place.
    Eigen::Vector2d dxy_dacross() const noexcept {
      return {inverse_step_ * (x_[1] + s_ * (2.0 * x_[2] + s_ * 3.0 * x_[3])),
              inverse_step_ * (y_[1] + s_ * (2.0 * y_[2] + s_ * 3.0 * y_[3]))};
    }

    bool exists() const noexcept { return !std::isnan(x_[0] + x_[3]); }

   private:
    friend class RayTable;
    double s_;
    double inverse_step_;
    double x_[4];
    double y_[4];
  };

  /// @param along maps scan line numbers to sensor pixels; @param line_count how many scan lines
  /// there are.
  RayTable(const CameraModel& camera, StripeAxis axis, const AxisGrid& along, int line_count);

  bool serves(StripeAxis axis, const AxisGrid& along, int line_count) const noexcept {
    return axis == axis_ && along == along_ && line_count == line_count_;
  }

  /// @param line 0 to line_count - 1. @param across_px sensor pixel; nothing exists more than a
  /// pixel outside the sensor, nor for NaN. About 3 ns.
  Segment at(int line, double across_px) const noexcept {
    const Place place = place_of(line, across_px);
    if (place.number < 0) return none();
    const double* const a = numbers() + place.number;
    Segment segment;
    segment.s_ = place.s;
    segment.inverse_step_ = inverse_step_;
    set_hermite(a[0], a[2], a[4], a[6], segment.x_);
    set_hermite(a[1], a[3], a[5], a[7], segment.y_);
    return segment;
  }

  /// Where a ray is in the table: for vectorised readers of `numbers()`.
  struct Place {
    std::int64_t number;  ///< Index of the segment's first number; -1 where there is no segment.
    double s;             ///< Place within the segment, 0 to 1.
  };

  Place place_of(int line, double across_px) const noexcept {
    const double t = (across_px - first_px_) * inverse_step_;
    if (!(t >= 0.0 && t < segments_)) return {-1, 0.0};  // So written that a NaN ends here too.
    const auto k = static_cast<std::int64_t>(t);
    return {kNumbersPerNode * (line * nodes_per_line_ + k), t - static_cast<double>(k)};
  }

  /// x, y and their slopes per node step, node after node. A segment is eight numbers: its two
  /// nodes.
  const double* numbers() const noexcept { return &nodes_.data()->x; }

  /// Nodes per sensor pixel.
  double inverse_step() const noexcept { return inverse_step_; }

 private:
  struct Node {
    double x, y, slope_x, slope_y;
  };
  static constexpr std::int64_t kNumbersPerNode = sizeof(Node) / sizeof(double);

  // Coefficients of the cubic with these values and slopes (per node step) at 0 and 1.
  static void set_hermite(double a, double slope_a, double b, double slope_b, double* c) noexcept {
    c[0] = a;
    c[1] = slope_a;
    c[3] = slope_a + slope_b - 2.0 * (b - a);
    c[2] = (b - a) - slope_a - c[3];
  }

  static Segment none() noexcept;
  Node exact_node(const CameraModel& camera, int line, double across_px, double step_px) const;
  void fill(const CameraModel& camera, double step_px);
  double worst_error_px(const CameraModel& camera) const;

  StripeAxis axis_;
  AxisGrid along_;
  int line_count_;
  double first_px_ = -1.0;  // The error bars ask for half a pixel beyond the sensor's edge.
  double last_px_;
  double inverse_step_ = 1.0;
  double segments_ = 0.0;
  std::int64_t nodes_per_line_ = 0;
  std::vector<Node> nodes_;
};

}  // namespace striper::detail
