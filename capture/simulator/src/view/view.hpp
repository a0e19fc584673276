// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <opencv2/core/mat.hpp>

#include "light/beam.hpp"
#include "light/shading.hpp"
#include "scene/world.hpp"
#include "view/ray_grid.hpp"
#include "view/tiles.hpp"

namespace striper::detail {

/// What the camera sees at one moment: the world, and which facet each pixel's centre sees.
class View {
 public:
  View(const Scene& scene, const RayGrid& rays, double time_s);
  View(const View&) = delete;
  View& operator=(const View&) = delete;

  const Scene& scene() const noexcept { return scene_; }
  const RayGrid& rays() const noexcept { return rays_; }
  const World& world() const noexcept { return world_; }
  const Shading& shading() const noexcept { return shading_; }

  /// What the centre of a sensor pixel of the region sees.
  const Hit& hit(int u, int v) const noexcept {
    return hits_[static_cast<std::size_t>(v - rays_.region().y) *
                     static_cast<std::size_t>(rays_.region().width) +
                 static_cast<std::size_t>(u - rays_.region().x)];
  }

  /// What a ray through or near a pixel sees.
  Hit cast(int u, int v, const Eigen::Vector3d& ray) const noexcept {
    return world_.first_hit(ray, tiles_.at(u, v));
  }

  const Tiles& tiles() const noexcept { return tiles_; }

  /// What may stand between a hit in or near a pixel and the sun.
  std::span<const int> casters(int u, int v, const Hit& hit) const noexcept {
    return hit.found() ? tiles_.of(u, v, hit.facet).casters : std::span<const int>();
  }

  /// Electrons from daylight and light sources per sensor pixel of the region, CV_32FC1, lens blur
  /// included.
  cv::Mat daylight() const;

  /// Electrons from one laser's pulse per sensor pixel of the region, CV_32FC1, lens blur included.
  cv::Mat laser(const Beam& beam, int index) const;

 private:
  const Scene& scene_;
  const RayGrid& rays_;
  World world_;
  Shading shading_;
  Tiles tiles_;
  std::vector<Hit> hits_;
};

/// Convolves a CV_32FC1 image with a Gaussian, in plain arithmetic.
cv::Mat blurred(const cv::Mat& image, double sigma_px);

}  // namespace striper::detail
