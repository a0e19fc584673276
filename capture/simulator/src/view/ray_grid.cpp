// SPDX-License-Identifier: Apache-2.0
#include "view/ray_grid.hpp"

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

Eigen::Vector2d RayGrid::interpolate(int u, int v, const RayPlace& place) const noexcept {
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();
  for (int j = 0; j < 4; ++j) {
    const Eigen::Vector2d* const rays = &at(u + place.u0 - 1, v + place.v0 - 1 + j);
    Eigen::Vector2d row = Eigen::Vector2d::Zero();
    for (int i = 0; i < 4; ++i) row += place.across[i] * rays[i];
    ray += place.down[j] * row;
  }
  return ray;
}

}  // namespace striper::detail
