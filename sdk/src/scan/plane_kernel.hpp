// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

namespace striper::detail {

/// A batch of returns on their way from the ray table to the laser plane, as parallel arrays.
struct PlaneBatch {
  static constexpr int kSize = 64;
  template <typename T>
  using Values = std::array<T, kSize>;

  // In: where in the table each ray is.
  alignas(64) Values<std::int64_t> node;  // Of the table's numbers, the first one of the segment.
  alignas(64) Values<double> s;           // Place within the segment, 0 to 1.

  // Out.
  alignas(64) Values<double> x_m;
  alignas(64) Values<double> y_m;
  alignas(64) Values<double> range_m;
  alignas(64) Values<double> bearing_rad;  // NaN where the direction is too far from the reference.
  alignas(64) Values<double> range_near_m;  // The rays half a pixel to either side; inf beyond the
  alignas(64) Values<double> range_far_m;   // horizon.
  alignas(64) Values<double> drange_dacross;  // Metres per sensor pixel.
  alignas(64) Values<double> w;  // Positive where the ray meets the plane in front of the camera.
};

/// What is the same for a whole batch.
struct PlaneKernelInput {
  const double* nodes;   // The ray table's: x, y, slope_x, slope_y of each node.
  double inverse_step;   // Nodes per sensor pixel.
  double half_pixel_px;  // Half a pixel of the image, in sensor pixels.
  Eigen::Matrix3d H;     // From (x, y, 1) to the scan plane.
  double x_reference_m;  // A point in whose direction most of the batch lies.
  double y_reference_m;
  double bearing_reference_rad;
};

/// Fills the outputs of `batch`, all kSize of them: unused ones need a valid node. Runs on the
/// widest vectors that the machine has.
void project_batch(const PlaneKernelInput& input, PlaneBatch& batch);

}  // namespace striper::detail
