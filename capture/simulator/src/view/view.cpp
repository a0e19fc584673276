// SPDX-License-Identifier: Apache-2.0
#include "view/view.hpp"

namespace striper::detail {

View::View(const Scene& scene, const RayGrid& rays, double time_s)
    : scene_(scene),
      rays_(rays),
      world_(scene, time_s),
      shading_(scene, world_),
      tiles_(world_, rays, shading_.has_shadows()) {
  const cv::Rect& region = rays.region();
  hits_.reserve(static_cast<std::size_t>(region.area()));
  for (int v = region.y; v < region.y + region.height; ++v) {
    for (int u = region.x; u < region.x + region.width; ++u) {
      const Eigen::Vector2d& ray = rays.at(u, v);
      hits_.push_back(ray.allFinite() ? cast(u, v, ray.homogeneous()) : Hit{});
    }
  }
}

}  // namespace striper::detail
