// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <striper/simulator/scene.hpp>

namespace striper::detail {

/// A piece of an object's surface in the camera's frame.
struct Facet {
  enum class Kind { kRectangle, kDisc, kTube };

  Kind kind = Kind::kRectangle;
  int object = -1;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();   ///< Unit; as seen from the front.
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();      ///< Unit; the axis of a tube.
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< Unit, towards the front.
  double half_width = 0.0;   ///< Along `right`; the radius of a disc or tube; may be infinite.
  double half_height = 0.0;  ///< Along `up`; may be infinite.
  double bounding_radius = 0.0;
  double distance = 0.0;  ///< Of its plane from the camera, along `normal`.

  bool is_endless() const noexcept { return !std::isfinite(half_width * half_height); }
  /// The corners of a rectangle, one after the other around it.
  std::array<Eigen::Vector3d, 4> corners() const noexcept;
};

struct Ball {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 0.0;
};

/// A facet that may be seen in some part of the image.
struct Sight {
  int facet = -1;
  int number = 0;                     ///< Of all in the image.
  double nearest_t = 0.0;             ///< The rays there do not meet it nearer than this.
  Ball seen;                          ///< What is seen of it there lies within.
  std::span<const int> casters = {};  ///< What may stand between that and the sun.
};

/// Where a ray (x, y, 1) from the camera's centre meets a facet: t * ray.
struct Hit {
  double t = std::numeric_limits<double>::infinity();
  int facet = -1;

  bool found() const noexcept { return facet >= 0; }
};

/// Everything in the scene at one moment, in the camera's frame. Immutable, thread-safe.
class World {
 public:
  World(const Scene& scene, double time_s);

  const std::vector<Facet>& facets() const noexcept { return facets_; }
  const Facet& facet(int index) const noexcept { return facets_[static_cast<std::size_t>(index)]; }
  const Eigen::Vector3d& to_sun() const noexcept { return to_sun_; }
  const Eigen::Vector3d& up() const noexcept { return up_; }

  /// The first facet that a ray (x, y, 1) from the camera's centre meets, of those that may be seen
  /// there, the nearest first. Of two at the same place it is the one that was made first.
  Hit first_hit(const Eigen::Vector3d& ray, std::span<const Sight> sights) const noexcept;

  /// True where one of `casters` stands between two points.
  bool blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
               std::span<const int> casters) const noexcept;
  /// The facets that may stand between a facet and the sun.
  std::vector<int> sun_casters(int facet) const;
  /// False where a facet is known to stand between no point of a ball and the sun.
  bool may_shade(int caster, const Ball& receiver) const noexcept;
  /// The same of what is seen of a facet and a light source.
  bool may_block(int caster, const Eigen::Vector3d& light_source,
                 const Sight& receiver) const noexcept;
  /// True where one of `casters` stands between a point and the sun.
  bool in_shade(const Eigen::Vector3d& point, std::span<const int> casters) const noexcept;

  /// The outward normal of a facet at a point of it, turned towards the camera.
  Eigen::Vector3d normal_to_camera(int facet, const Eigen::Vector3d& point) const noexcept;

  /// Where a ray from the camera meets the facet's endless surface (the nearer side of a tube);
  /// NaN if nowhere in front.
  double surface_t(int facet, const Eigen::Vector3d& ray) const noexcept;

 private:
  std::vector<Facet> facets_;
  Eigen::Vector3d to_sun_;
  Eigen::Vector3d up_;
};

/// The pose of an object in the camera's frame at a time.
Eigen::Isometry3d T_cam_object_at(const Scene& scene, const SceneObject& object, double time_s);

}  // namespace striper::detail
