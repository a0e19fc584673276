// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <striper/simulator/scene.hpp>

#include "light/beam.hpp"
#include "scene/world.hpp"

namespace striper::detail {

/// What a spot of a surface reflects, its texture looked up.
struct Reflection {
  double reflectance = 0.0;
  double retro_gain = 0.0;
  double retro_spread_rad = 1.0;
  int patch = 0;  ///< Which part of the texture; differs on the two sides of an edge in it.

  /// Radiance over irradiance for an angle between light and camera at the surface, 1/sr.
  double brdf(double cos_angle) const noexcept;
};

Reflection reflection_at(const Material& material, const Facet& facet,
                         const Eigen::Vector3d& point) noexcept;

/// Turns light on the scene's surfaces into electrons in the camera's pixels.
class Shading {
 public:
  Shading(const Scene& scene, const World& world);

  /// Whether the sun shines and what it shines on casts shadows.
  bool has_shadows() const noexcept {
    return scene_.daylight.shadows && scene_.daylight.sun_w_m2_nm > 0.0;
  }

  /// Electrons that daylight and light sources put into a pixel which sees this hit (or no hit at
  /// all).
  /// @param spot its texture, looked up. @param casters what may stand between it and the sun.
  double daylight_electrons(const Hit& hit, const Eigen::Vector3d& ray, const Reflection& spot,
                            std::span<const int> casters) const noexcept;

  /// Electrons per J/m^2 of fluence from `origin` on a spot of a surface, as a pixel sees it.
  double electrons_per_fluence(const Reflection& spot, const Eigen::Vector3d& point,
                               const Eigen::Vector3d& origin, int laser) const noexcept;

  Reflection reflection(const Hit& hit, const Eigen::Vector3d& point) const noexcept;

 private:
  /// The daylight on a facet: constant where it is flat.
  struct FacetLight {
    double diffuse_w_m2_nm = 0.0;  ///< From sky and surroundings.
    double sun_w_m2_nm = 0.0;      ///< From the sun, shadows left out.
    double own_radiance = 0.0;
    const Material* material = nullptr;
  };

  FacetLight light_on(const Eigen::Vector3d& normal) const noexcept;
  double falloff(const Eigen::Vector3d& ray) const noexcept;

  const Scene& scene_;
  const World& world_;
  double daylight_scale_;            // Electrons per W/(m^2 sr nm).
  std::vector<double> laser_scale_;  // Electrons per J/(m^2 sr).
  std::vector<FacetLight> facets_;
};

}  // namespace striper::detail
