// SPDX-License-Identifier: Apache-2.0
#include "simulator/ray_grid.hpp"

#include <cmath>

namespace striper::detail {

RayGrid::RayGrid(const CameraModel& camera, cv::Rect region)
    : region_(region), stride_(static_cast<std::size_t>(region.width) + 2 * kMargin) {
  rays_.reserve(stride_ * (static_cast<std::size_t>(region.height) + 2 * kMargin));
  for (int v = region.y - kMargin; v < region.y + region.height + kMargin; ++v) {
    for (int u = region.x - kMargin; u < region.x + region.width + kMargin; ++u) {
      rays_.push_back(camera.unproject({u, v}).xy);
    }
  }
}

Eigen::Vector2d RayGrid::interpolate(double u, double v) const noexcept {
  const int u0 = static_cast<int>(std::floor(u));
  const int v0 = static_cast<int>(std::floor(v));
  const Eigen::Vector4d across = cubic_weights(u - u0);
  const Eigen::Vector4d down = cubic_weights(v - v0);
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();
  for (int j = 0; j < 4; ++j) {
    Eigen::Vector2d row = Eigen::Vector2d::Zero();
    for (int i = 0; i < 4; ++i) row += across[i] * at(u0 - 1 + i, v0 - 1 + j);
    ray += down[j] * row;
  }
  return ray;
}

}  // namespace striper::detail
