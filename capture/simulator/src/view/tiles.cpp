// SPDX-License-Identifier: Apache-2.0
#include "view/tiles.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::clamp(a.dot(b), -1.0, 1.0));
}

/// A cone of rays from the camera's centre.
struct Cone {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  double half_angle_rad = M_PI;

  bool may_see(const Facet& facet) const {
    const double distance = facet.center.norm();
    if (facet.bounding_radius < distance) {
      const double away = angle_between(axis, facet.center / distance);
      if (away > half_angle_rad + std::asin(facet.bounding_radius / distance)) return false;
    }
    if (facet.kind == Facet::Kind::kTube) return true;
    // The camera is in its plane: what is seen is a line, and of which side nobody knows.
    constexpr double kEdgeOn_m = 1e-6;
    if (std::abs(facet.distance) < kEdgeOn_m) return true;
    // All rays go away from its plane, or pass by one of its sides.
    const Eigen::Vector3d towards = std::copysign(1.0, facet.distance) * facet.normal;
    if (is_beyond(towards, 1.0)) return false;
    return facet.kind == Facet::Kind::kDisc || facet.is_endless() || !passes_by(facet);
  }

  /// Whether every ray of the cone has an obtuse angle to `inwards`.
  bool is_beyond(const Eigen::Vector3d& inwards, double norm) const {
    constexpr double kToSpare = 1e-6;
    return half_angle_rad < 1.5 &&
           inwards.dot(axis) < -norm * (std::sin(half_angle_rad) + kToSpare);
  }

  bool passes_by(const Facet& facet) const {
    const auto corners = facet.corners();
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector3d side = corners[i].cross(corners[(i + 1) % 4]);
      const bool is_inwards = side.dot(facet.center) > 0.0;
      if (is_beyond(is_inwards ? side : Eigen::Vector3d(-side), side.norm())) return true;
    }
    return false;
  }

  /// The smallest z of the cone's unit rays, 0 if it reaches sideways.
  double smallest_z() const {
    const double away = angle_between(axis, Eigen::Vector3d::UnitZ()) + half_angle_rad;
    return away < 0.5 * M_PI ? std::cos(away) : 0.0;
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
    cone.half_angle_rad = std::max(cone.half_angle_rad, angle_between(cone.axis, corner));
  }
  cone.half_angle_rad *= 1.1;  // The lens may bend the block's edges outwards.
  return cone;
}

/// Between which distances from the camera a cone meets a facet.
struct Reach {
  double nearest = 0.0;
  double farthest = kInfinity;
};

Reach reach_of(const Facet& facet, const Cone& cone) {
  constexpr double kRounding = 1e-9;
  constexpr double kGrazing_rad = 1e-3;
  const double distance = facet.center.norm();
  Reach reach{std::max(0.0, distance - facet.bounding_radius), distance + facet.bounding_radius};
  if (facet.kind != Facet::Kind::kTube) {
    const double away = angle_between(cone.axis, facet.normal);
    const double off_normal = std::min(away, M_PI - away);
    const double steepest = std::cos(std::max(0.0, off_normal - cone.half_angle_rad));
    reach.nearest = std::max(reach.nearest, std::abs(facet.distance) / steepest);
    const double flattest = off_normal + cone.half_angle_rad;
    if (flattest < 0.5 * M_PI - kGrazing_rad) {
      reach.farthest = std::min(reach.farthest, std::abs(facet.distance) / std::cos(flattest));
    }
  }
  return {reach.nearest * (1.0 - kRounding), reach.farthest * (1.0 + kRounding)};
}

/// A ball around what is seen of a facet in a cone; endless where that is.
Ball seen_part(const Facet& facet, const Cone& cone, const Reach& reach) {
  if (!(reach.farthest < kInfinity)) return {facet.center, facet.bounding_radius};
  const double half_length = 0.5 * (reach.farthest - reach.nearest);
  const Ball seen{(reach.nearest + half_length) * cone.axis,
                  half_length + reach.farthest * std::sin(std::min(cone.half_angle_rad, 1.5))};
  return seen.radius < facet.bounding_radius ? seen : Ball{facet.center, facet.bounding_radius};
}

}  // namespace

Tiles::Tiles(const World& world, const RayGrid& rays, bool with_shadows)
    : region_(rays.region()), across_((region_.width + kSize - 1) / kSize) {
  const auto& facets = world.facets();
  std::vector<std::vector<int>> all_casters(facets.size());
  for (std::size_t i = 0; with_shadows && i < facets.size(); ++i) {
    all_casters[i] = world.sun_casters(static_cast<int>(i));
  }
  const int down = (region_.height + kSize - 1) / kSize;
  for (int row = 0; row < down; ++row) {
    for (int column = 0; column < across_; ++column) {
      const cv::Rect block =
          cv::Rect(region_.x + column * kSize, region_.y + row * kSize, kSize, kSize) & region_;
      const Cone cone = cone_of(rays, block);
      const double smallest_z = cone.smallest_z();
      std::vector<Sight>& tile = tiles_.emplace_back();
      for (std::size_t i = 0; i < facets.size(); ++i) {
        if (!cone.may_see(facets[i])) continue;
        const Reach reach = reach_of(facets[i], cone);
        Sight& sight = tile.emplace_back();
        sight.facet = static_cast<int>(i);
        sight.number = sight_count_++;
        sight.nearest_t = reach.nearest * smallest_z;
        sight.seen = seen_part(facets[i], cone, reach);
        if (all_casters[i].empty()) continue;
        std::vector<int>& casters = casters_.emplace_back();
        for (const int caster : all_casters[i]) {
          if (world.may_shade(caster, sight.seen)) casters.push_back(caster);
        }
        sight.casters = casters;
      }
      std::stable_sort(tile.begin(), tile.end(),
                       [](const Sight& a, const Sight& b) { return a.nearest_t < b.nearest_t; });
    }
  }
}

}  // namespace striper::detail
