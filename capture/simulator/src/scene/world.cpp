// SPDX-License-Identifier: Apache-2.0
#include "scene/world.hpp"

#include <algorithm>

namespace striper::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A shadow ray starts and ends this far, relative to its length, from the surfaces it joins.
constexpr double kShadowMargin = 1e-6;

/// Puts the facets of one shape, in the object's frame, into a list.
struct FacetMaker {
  std::vector<Facet>& facets;

  void rectangle(const Eigen::Vector3d& center, const Eigen::Vector3d& right,
                 const Eigen::Vector3d& up, double width, double height) {
    Facet facet;
    facet.center = center;
    facet.right = right;
    facet.up = up;
    facet.normal = right.cross(up);
    facet.half_width = 0.5 * width;
    facet.half_height = 0.5 * height;
    facet.bounding_radius = std::hypot(facet.half_width, facet.half_height);
    facets.push_back(facet);
  }

  void disc(const Eigen::Vector3d& center, const Eigen::Vector3d& right, const Eigen::Vector3d& up,
            double radius) {
    rectangle(center, right, up, 2.0 * radius, 2.0 * radius);
    facets.back().kind = Facet::Kind::kDisc;
    facets.back().bounding_radius = radius;
  }

  void operator()(const Plane&) {
    rectangle(Eigen::Vector3d::Zero(), -Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ(),
              kInfinity, kInfinity);
  }

  void operator()(const Rectangle& shape) {
    rectangle(Eigen::Vector3d::Zero(), -Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ(),
              shape.width_m, shape.height_m);
  }

  void operator()(const Disc& shape) {
    disc(Eigen::Vector3d::Zero(), -Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ(),
         shape.radius_m);
  }

  void operator()(const Box& shape) {
    const Eigen::Vector3d half = 0.5 * shape.size_m;
    for (int axis = 0; axis < 3; ++axis) {
      const int right = (axis + 1) % 3;
      const int up = (axis + 2) % 3;
      for (const double sign : {-1.0, 1.0}) {
        rectangle(sign * half[axis] * Eigen::Vector3d::Unit(axis),
                  sign * Eigen::Vector3d::Unit(right), Eigen::Vector3d::Unit(up),
                  shape.size_m[right], shape.size_m[up]);
      }
    }
  }

  void operator()(const Cylinder& shape) {
    Facet tube;
    tube.kind = Facet::Kind::kTube;
    tube.right = -Eigen::Vector3d::UnitY();
    tube.up = Eigen::Vector3d::UnitZ();
    tube.normal = -Eigen::Vector3d::UnitX();
    tube.half_width = shape.radius_m;
    tube.half_height = 0.5 * shape.length_m;
    tube.bounding_radius = std::hypot(tube.half_width, tube.half_height);
    facets.push_back(tube);
    for (const double sign : {-1.0, 1.0}) {
      disc(Eigen::Vector3d(0.0, 0.0, sign * tube.half_height), Eigen::Vector3d::UnitX(),
           sign * Eigen::Vector3d::UnitY(), shape.radius_m);
    }
  }

  void operator()(const Sweep& shape) {
    for (std::size_t i = 1; i < shape.profile_m.size(); ++i) {
      const Eigen::Vector2d from = shape.profile_m[i - 1];
      const Eigen::Vector2d piece = shape.profile_m[i] - from;
      const Eigen::Vector2d middle = from + 0.5 * piece;
      const Eigen::Vector2d across = piece.normalized();
      rectangle({0.0, middle.x(), middle.y()}, {0.0, across.x(), across.y()},
                Eigen::Vector3d::UnitX(), piece.norm(), shape.length_m);
    }
  }
};

/// Whether a point of a flat facet's plane lies on the facet. @param offset from its centre.
bool contains(const Facet& facet, const Eigen::Vector3d& offset) noexcept {
  const double a = facet.right.dot(offset);
  const double b = facet.up.dot(offset);
  return facet.kind == Facet::Kind::kDisc
             ? a * a + b * b <= facet.half_width * facet.half_width
             : std::abs(a) <= facet.half_width && std::abs(b) <= facet.half_height;
}

/// Distance along a ray to a facet, or infinity; only between `t_min` and `t_max`.
double intersect(const Facet& facet, const Eigen::Vector3d& origin,
                 const Eigen::Vector3d& direction, double t_min,
                 double t_max = kInfinity) noexcept {
  const Eigen::Vector3d to_center = facet.center - origin;
  if (facet.kind != Facet::Kind::kTube) {
    const double slope = facet.normal.dot(direction);
    const double height = facet.normal.dot(to_center);
    if (!(height * slope > 0.0)) return kInfinity;  // Behind, or along the plane: no division.
    const double t = height / slope;
    if (!(t > t_min && t < t_max)) return kInfinity;
    return contains(facet, t * direction - to_center) ? t : kInfinity;
  }
  const Eigen::Vector3d d = direction - facet.up.dot(direction) * facet.up;
  const Eigen::Vector3d c = to_center - facet.up.dot(to_center) * facet.up;
  const double a = d.squaredNorm();
  const double b = d.dot(c);
  const double discriminant = b * b - a * (c.squaredNorm() - facet.half_width * facet.half_width);
  if (a == 0.0 || discriminant < 0.0) return kInfinity;
  const double root = std::sqrt(discriminant);
  for (const double t : {(b - root) / a, (b + root) / a}) {
    const double height = facet.up.dot(t * direction - to_center);
    if (t > t_min && std::abs(height) <= facet.half_height) return t;
  }
  return kInfinity;
}

/// The same for a ray from the camera, to the last bit; only up to and with `t_max`.
double meet(const Facet& facet, const Eigen::Vector3d& ray, double t_max) noexcept {
  if (facet.kind == Facet::Kind::kTube) {
    return intersect(facet, Eigen::Vector3d::Zero(), ray, 0.0);
  }
  const double slope = facet.normal.dot(ray);
  if (slope == 0.0) return kInfinity;
  const double t = facet.distance / slope;
  if (!(t > 0.0 && t <= t_max)) return kInfinity;
  if (facet.half_width == kInfinity && facet.half_height == kInfinity) return t;
  return contains(facet, t * ray - facet.center) ? t : kInfinity;
}

/// Whether a ray is known to miss a tube, by the sphere around it; of a flat facet `intersect` is
/// as fast.
bool misses_sphere(const Facet& facet, const Eigen::Vector3d& origin,
                   const Eigen::Vector3d& direction, double direction_norm2) noexcept {
  if (facet.kind != Facet::Kind::kTube) return false;
  const Eigen::Vector3d to_center = facet.center - origin;
  const double along = to_center.dot(direction);
  const double radius2 = facet.bounding_radius * facet.bounding_radius;
  return to_center.squaredNorm() - along * along / direction_norm2 > radius2;
}

}  // namespace

std::array<Eigen::Vector3d, 4> Facet::corners() const noexcept {
  const Eigen::Vector3d across = half_width * right;
  const Eigen::Vector3d along = half_height * up;
  return {center - across - along, center + across - along, center + across + along,
          center - across + along};
}

Eigen::Isometry3d T_cam_object_at(const Scene& scene, const SceneObject& object, double time_s) {
  const Eigen::Isometry3d T_world_cam =
      scene.device_motion.moved(scene.T_world_device, time_s) * scene.T_device_cam();
  return T_world_cam.inverse() * object.motion.moved(object.T_world_object, time_s);
}

World::World(const Scene& scene, double time_s) {
  for (std::size_t index = 0; index < scene.objects.size(); ++index) {
    const SceneObject& object = scene.objects[index];
    const std::size_t first = facets_.size();
    std::visit(FacetMaker{facets_}, object.shape);
    const Eigen::Isometry3d T_cam_object = T_cam_object_at(scene, object, time_s);
    for (std::size_t i = first; i < facets_.size(); ++i) {
      Facet& facet = facets_[i];
      facet.object = static_cast<int>(index);
      facet.center = T_cam_object * facet.center;
      facet.right = T_cam_object.linear() * facet.right;
      facet.up = T_cam_object.linear() * facet.up;
      facet.normal = T_cam_object.linear() * facet.normal;
      facet.distance = facet.normal.dot(facet.center);
    }
  }
  const Eigen::Matrix3d R_cam_world =
      (scene.device_motion.moved(scene.T_world_device, time_s) * scene.T_device_cam())
          .linear()
          .transpose();
  to_sun_ = R_cam_world * scene.daylight.sun_direction.normalized();
  up_ = R_cam_world * Eigen::Vector3d::UnitZ();
}

Hit World::first_hit(const Eigen::Vector3d& ray, std::span<const Sight> sights) const noexcept {
  Hit hit;
  for (const Sight& sight : sights) {
    if (sight.nearest_t > hit.t) break;
    const double t = meet(facet(sight.facet), ray, hit.t);
    if (t < hit.t || (t == hit.t && sight.facet < hit.facet)) hit = {t, sight.facet};
  }
  return hit;
}

bool World::blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                    std::span<const int> casters) const noexcept {
  const Eigen::Vector3d direction = to - from;
  const double norm2 = direction.squaredNorm();
  return std::any_of(casters.begin(), casters.end(), [&](int index) {
    const Facet& caster = facet(index);
    return !misses_sphere(caster, from, direction, norm2) &&
           intersect(caster, from, direction, kShadowMargin) < 1.0 - kShadowMargin;
  });
}

// That something is not in the way is decided with this much to spare, relative to sizes.
constexpr double kToSpare = 1e-9;

namespace {

/// False where the shadow of a flat facet's whole rectangle is known to fall beside that of another
/// flat facet. The shadow is on the other's endless plane, whichever is nearer to the sun.
bool falls_onto(const Facet& caster, const Facet& receiver, const Eigen::Vector3d& to_sun) {
  constexpr double kGrazing = 1e-3;
  const double slope = receiver.normal.dot(to_sun);
  const bool is_flat = caster.kind != Facet::Kind::kTube && receiver.kind != Facet::Kind::kTube;
  if (!is_flat || caster.is_endless() || std::abs(slope) < kGrazing) return true;
  Eigen::AlignedBox2d shadow;
  for (const Eigen::Vector3d& corner : caster.corners()) {
    const Eigen::Vector3d offset = corner - receiver.center;
    const Eigen::Vector3d fallen = offset - receiver.normal.dot(offset) / slope * to_sun;
    shadow.extend(Eigen::Vector2d(receiver.right.dot(fallen), receiver.up.dot(fallen)));
  }
  const Eigen::Vector2d half_size(receiver.half_width, receiver.half_height);
  const double spare =
      kToSpare * (1.0 + caster.bounding_radius + caster.center.norm()) / std::abs(slope);
  return ((shadow.min() - half_size).array() <= spare).all() &&
         ((shadow.max() + half_size).array() >= -spare).all();
}

}  // namespace

std::vector<int> World::sun_casters(int index) const {
  const Facet& receiver = facet(index);
  std::vector<int> casters;
  for (std::size_t i = 0; i < facets_.size(); ++i) {
    const Facet& caster = facets_[i];
    const bool is_itself = static_cast<int>(i) == index;
    if (is_itself && caster.kind != Facet::Kind::kTube) continue;
    // The receiver's bounding sphere, swept towards the sun, must touch the caster's.
    const Eigen::Vector3d away = caster.center - receiver.center;
    const double reach = caster.bounding_radius + receiver.bounding_radius;
    const double towards_sun = away.dot(to_sun_);
    const bool is_beside = (away - towards_sun * to_sun_).norm() > reach;
    if (is_beside || towards_sun < -reach) continue;
    if (falls_onto(caster, receiver, to_sun_)) casters.push_back(static_cast<int>(i));
  }
  return casters;
}

bool World::may_shade(int index, const Ball& receiver) const noexcept {
  const Facet& caster = facet(index);
  const Eigen::Vector3d away = caster.center - receiver.center;
  const double reach = (caster.bounding_radius + receiver.radius) * (1.0 + kToSpare) + kToSpare;
  const double towards_sun = away.dot(to_sun_);
  if ((away - towards_sun * to_sun_).norm() > reach || towards_sun < -reach) return false;
  const double slope = caster.normal.dot(to_sun_);
  if (caster.kind == Facet::Kind::kTube || std::abs(slope) < 1e-3) return true;

  // Where the rays from the ball to the sun meet the caster's plane.
  const double t = caster.normal.dot(away) / slope;
  if (t + receiver.radius / std::abs(slope) < 0.5 * kShadowMargin) return false;
  const Eigen::Vector3d offset = t * to_sun_ - away;
  const auto misses = [&](const Eigen::Vector3d& axis, double half_size) {
    const double spread = receiver.radius * (1.0 + std::abs(axis.dot(to_sun_) / slope));
    return std::abs(axis.dot(offset)) > (half_size + spread) * (1.0 + kToSpare) + kToSpare;
  };
  return !misses(caster.right, caster.half_width) && !misses(caster.up, caster.half_height);
}

bool World::may_block(int index, const Eigen::Vector3d& light_source,
                      const Sight& receiver) const noexcept {
  constexpr double kEdgeOn_m = 1e-6;
  const Facet& caster = facet(index);
  if (caster.kind == Facet::Kind::kTube) return true;
  const double light_source_height = caster.normal.dot(light_source - caster.center);
  if (std::abs(light_source_height) < kEdgeOn_m) return true;
  if (index == receiver.facet) return false;

  // On the light source's own side of the caster's plane, or beside the pyramid over the caster.
  const Ball& ball = receiver.seen;
  const double spread = ball.radius * (1.0 + kToSpare) + kToSpare;
  const double ball_height = caster.normal.dot(ball.center - caster.center);
  if (light_source_height > 0.0 ? ball_height > spread : ball_height < -spread) return false;
  if (caster.kind == Facet::Kind::kDisc || caster.is_endless()) return true;
  const auto corners = caster.corners();
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d side =
        (corners[i] - light_source).cross(corners[(i + 1) % 4] - light_source);
    const double inwards = std::copysign(1.0, side.dot(caster.center - light_source));
    if (inwards * side.dot(ball.center - light_source) < -spread * side.norm()) return false;
  }
  return true;
}

bool World::in_shade(const Eigen::Vector3d& point, std::span<const int> casters) const noexcept {
  if (casters.empty()) return false;
  const double margin = kShadowMargin * (1.0 + point.norm());
  return std::any_of(casters.begin(), casters.end(), [&](int index) {
    const Facet& caster = facet(index);
    return !misses_sphere(caster, point, to_sun_, 1.0) &&
           intersect(caster, point, to_sun_, margin) < kInfinity;
  });
}

Eigen::Vector3d World::normal_to_camera(int index, const Eigen::Vector3d& point) const noexcept {
  const Facet& surface = facet(index);
  Eigen::Vector3d normal = surface.normal;
  if (surface.kind == Facet::Kind::kTube) {
    const Eigen::Vector3d offset = point - surface.center;
    normal = (offset - surface.up.dot(offset) * surface.up) / surface.half_width;
  }
  return normal.dot(point) > 0.0 ? Eigen::Vector3d(-normal) : normal;
}

double World::surface_t(int index, const Eigen::Vector3d& ray) const noexcept {
  Facet endless = facet(index);
  endless.kind = endless.kind == Facet::Kind::kDisc ? Facet::Kind::kRectangle : endless.kind;
  endless.half_height = kInfinity;
  if (endless.kind == Facet::Kind::kRectangle) endless.half_width = kInfinity;
  const double t = intersect(endless, Eigen::Vector3d::Zero(), ray, 0.0);
  return t < kInfinity ? t : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace striper::detail
