// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "scene/world.hpp"
#include "view/ray_grid.hpp"

namespace striper::detail {

/// What may be seen, and what may shade that, block by block of the image: looking at few facets
/// instead of all is most of the speed of rendering. What is left out is known not to be there, so
/// that images are the same without. Immutable, thread-safe.
class Tiles {
 public:
  /// @param with_shadows whether sights need their casters.
  Tiles(const World& world, const RayGrid& rays, bool with_shadows);
  Tiles(const Tiles&) = delete;
  Tiles& operator=(const Tiles&) = delete;

  /// The sights of a pixel of the region, and of rays up to a pixel beside it, the nearest first.
  std::span<const Sight> at(int u, int v) const noexcept {
    const int column = (u - region_.x) / kSize;
    const int row = (v - region_.y) / kSize;
    return tiles_[static_cast<std::size_t>(row * across_ + column)];
  }

  /// The one of a facet that a ray in or near a pixel met.
  const Sight& of(int u, int v, int facet) const noexcept {
    const std::span<const Sight> sights = at(u, v);
    std::size_t i = 0;
    while (sights[i].facet != facet) ++i;
    return sights[i];
  }

  int sight_count() const noexcept { return sight_count_; }

 private:
  static constexpr int kSize = 16;

  cv::Rect region_;
  int across_;
  int sight_count_ = 0;
  std::vector<std::vector<Sight>> tiles_;
  std::vector<std::vector<int>> casters_;  // Sights look into them.
};

}  // namespace striper::detail
