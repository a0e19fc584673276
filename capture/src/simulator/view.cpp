// SPDX-License-Identifier: Apache-2.0
#include "simulator/view.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

/// A cone of rays from the camera's centre.
struct Cone {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  double half_angle_rad = M_PI;

  bool may_see(const Facet& facet) const {
    const double distance = facet.center.norm();
    if (!(facet.bounding_radius < distance)) return true;
    const double away = std::acos(std::clamp(axis.dot(facet.center) / distance, -1.0, 1.0));
    return away <= half_angle_rad + std::asin(facet.bounding_radius / distance);
  }
};

/// The cone around the rays of a block of pixels and one pixel more on every side.
Cone cone_of(const RayGrid& rays, cv::Rect block) {
  std::vector<Eigen::Vector3d> corners;
  for (const int v : {block.y - 1, block.y + block.height}) {
    for (const int u : {block.x - 1, block.x + block.width}) {
      const Eigen::Vector2d& ray = rays.at(u, v);
      if (!ray.allFinite()) return {};
      corners.push_back(ray.homogeneous().normalized());
    }
  }
  Cone cone;
  cone.axis = (corners[0] + corners[1] + corners[2] + corners[3]).normalized();
  cone.half_angle_rad = 0.0;
  for (const Eigen::Vector3d& corner : corners) {
    const double angle = std::acos(std::clamp(cone.axis.dot(corner), -1.0, 1.0));
    cone.half_angle_rad = std::max(cone.half_angle_rad, angle);
  }
  cone.half_angle_rad *= 1.1;  // The lens may bend the block's edges outwards.
  return cone;
}

}  // namespace

View::View(const Scene& scene, const RayGrid& rays, double time_s)
    : scene_(scene), rays_(rays), world_(scene, time_s), shading_(scene, world_) {
  find_candidates();
  const cv::Rect& region = rays.region();
  hits_.reserve(static_cast<std::size_t>(region.area()));
  for (int v = region.y; v < region.y + region.height; ++v) {
    for (int u = region.x; u < region.x + region.width; ++u) {
      const Eigen::Vector2d& ray = rays.at(u, v);
      hits_.push_back(ray.allFinite() ? cast(u, v, ray.homogeneous()) : Hit{});
    }
  }
}

void View::find_candidates() {
  const cv::Rect& region = rays_.region();
  tiles_across_ = (region.width + kTile - 1) / kTile;
  const int tiles_down = (region.height + kTile - 1) / kTile;
  for (int row = 0; row < tiles_down; ++row) {
    for (int column = 0; column < tiles_across_; ++column) {
      const cv::Rect block =
          cv::Rect(region.x + column * kTile, region.y + row * kTile, kTile, kTile) & region;
      const Cone cone = cone_of(rays_, block);
      std::vector<int>& tile = tiles_.emplace_back();
      for (std::size_t i = 0; i < world_.facets().size(); ++i) {
        if (cone.may_see(world_.facets()[i])) tile.push_back(static_cast<int>(i));
      }
    }
  }
}

}  // namespace striper::detail
