// SPDX-License-Identifier: Apache-2.0
#include "simulator/shading.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <striper/simulator/radiometry.hpp>

#include "simulator/random.hpp"

namespace striper::detail {
namespace {

constexpr std::uint64_t kWearSeed = 1991;

void look_up(const Checkerboard& board, double right, double up, Reflection& spot) {
  const double column = right / board.square_m + 0.5 * (board.columns + 1);
  const double row = -up / board.square_m + 0.5 * (board.rows + 1);
  const double margin = board.border_m / board.square_m;
  const double columns = board.columns + 1.0;
  const double rows = board.rows + 1.0;
  if (column < -margin || column > columns + margin || row < -margin || row > rows + margin) return;
  const bool on_squares = column >= 0.0 && column < columns && row >= 0.0 && row < rows;
  const int parity = static_cast<int>(std::floor(column)) + static_cast<int>(std::floor(row));
  const bool is_black = on_squares && parity % 2 == 0;
  spot.reflectance = is_black ? board.black : board.white;
  spot.patch = is_black ? 1 : 2;
}

void look_up(const PaintedStripe& stripe, double right, double up, Reflection& spot) {
  if (std::abs(right - stripe.offset_m) > 0.5 * stripe.width_m) return;
  const double period = stripe.dash_m + stripe.gap_m;
  if (stripe.dash_m > 0.0 && up - period * std::floor(up / period) > stripe.dash_m) return;
  const auto cell_right = static_cast<std::int64_t>(std::floor(right / stripe.grain_m));
  const auto cell_up = static_cast<std::int64_t>(std::floor(up / stripe.grain_m));
  if (stripe.wear > 0.0 && PixelRandom(kWearSeed, 0, static_cast<std::uint64_t>(cell_right),
                                       static_cast<std::uint64_t>(cell_up))
                                   .uniform() < stripe.wear) {
    return;
  }
  spot.reflectance = stripe.reflectance;
  spot.retro_gain = stripe.retro_gain;
  spot.retro_spread_rad = stripe.retro_spread_rad;
  spot.patch = 1;
}

void look_up(std::monostate, double, double, Reflection&) {}

}  // namespace

double Reflection::brdf(double cos_angle) const noexcept {
  const double diffuse = reflectance / std::numbers::pi;
  if (retro_gain == 0.0) return diffuse;
  const double angle = std::acos(std::clamp(cos_angle, -1.0, 1.0)) / retro_spread_rad;
  return diffuse * (1.0 + retro_gain * std::exp(-0.5 * angle * angle));
}

Reflection reflection_at(const Material& material, const Facet& facet,
                         const Eigen::Vector3d& point) noexcept {
  Reflection spot{material.reflectance, material.retro_gain, material.retro_spread_rad, 0};
  if (facet.kind == Facet::Kind::kTube) return spot;
  const Eigen::Vector3d offset = point - facet.center;
  std::visit(
      [&](const auto& texture) {
        look_up(texture, facet.right.dot(offset), facet.up.dot(offset), spot);
      },
      material.texture);
  return spot;
}

Shading::Shading(const Scene& scene, const World& world) : scene_(scene), world_(world) {
  const BandPass& filter = scene.imager.filter;
  daylight_scale_ = electrons_per_radiance(scene.imager, filter.center_nm) * filter.width_nm *
                    scene.imager.shutter_s;
  for (const SimulatedLaser& laser : scene.lasers) {
    laser_scale_.push_back(electrons_per_radiance(scene.imager, laser.wavelength_nm));
  }
}

Reflection Shading::reflection(const Hit& hit, const Eigen::Vector3d& point) const noexcept {
  const Facet& facet = world_.facet(hit.facet);
  return reflection_at(scene_.objects[static_cast<std::size_t>(facet.object)].material, facet,
                       point);
}

double Shading::falloff(const Eigen::Vector3d& ray) const noexcept {
  if (scene_.imager.falloff_exponent == 0.0) return 1.0;
  return std::pow(ray.z() / ray.norm(), scene_.imager.falloff_exponent);
}

double Shading::daylight_electrons(const Hit& hit, const Eigen::Vector3d& ray) const noexcept {
  const Daylight& light = scene_.daylight;
  const double scale = daylight_scale_ * falloff(ray);
  if (!hit.found()) return scale * light.sky_radiance_w_m2_sr_nm;
  const Eigen::Vector3d point = hit.t * ray;
  const Eigen::Vector3d normal = world_.normal_to_camera(hit.facet, point);
  const Reflection spot = reflection(hit, point);

  const double sky_share = 0.5 * (1.0 + normal.dot(world_.up()));
  double radiance = (light.ambient_w_m2_nm + light.sky_w_m2_nm * sky_share) * spot.brdf(-1.0);
  const double cos_sun = normal.dot(world_.to_sun());
  if (light.sun_w_m2_nm > 0.0 && cos_sun > 0.0 && !(light.shadows && world_.in_shade(point))) {
    const double cos_angle = -world_.to_sun().dot(point) / point.norm();
    radiance += light.sun_w_m2_nm * cos_sun * spot.brdf(cos_angle);
  }
  const int object = world_.facet(hit.facet).object;
  radiance += scene_.objects[static_cast<std::size_t>(object)].material.radiance_w_m2_sr_nm;
  return scale * radiance;
}

double Shading::electrons_per_fluence(const Reflection& spot, const Eigen::Vector3d& point,
                                      const Eigen::Vector3d& origin, int laser) const noexcept {
  const double cos_angle =
      spot.retro_gain == 0.0 ? 1.0 : (origin - point).normalized().dot(-point.normalized());
  return laser_scale_[static_cast<std::size_t>(laser)] * falloff(point) * spot.brdf(cos_angle);
}

}  // namespace striper::detail
