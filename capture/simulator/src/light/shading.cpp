// SPDX-License-Identifier: Apache-2.0
#include "light/shading.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <striper/simulator/radiometry.hpp>

#include "light/random.hpp"

namespace striper::detail {
namespace {

constexpr std::uint64_t kWearSeed = 1991;
constexpr int kMottleOctaves = 2;
constexpr std::uint64_t kWoodOctave = 64;  // Apart from the mottle's.
constexpr std::uint64_t kPosterSeed = 2002;
constexpr std::uint64_t kPosterLevels = 3;
constexpr double kPosterShare = 0.6;  // Of the cells that are printed.

/// std::floor without a call where the processor has no such instruction; |x| below 2^63.
std::int64_t floor_of(double x) {
  const auto whole = static_cast<std::int64_t>(x);
  return static_cast<double>(whole) > x ? whole - 1 : whole;
}

/// A random number between 0 and 1 for each point of a lattice.
double lattice_value(std::int64_t i, std::int64_t j, std::uint64_t octave) {
  const auto column = static_cast<std::uint64_t>(i);
  const auto row = static_cast<std::uint64_t>(j);
  const std::uint64_t key = column * 0x9E3779B97F4A7C15ULL + row * 0xC2B2AE3D27D4EB4FULL + octave;
  return static_cast<double>(PixelRandom::mix(key) >> 11U) * 0x1.0p-53;
}

/// Smooth noise between -1 and 1: random values on a lattice, blended (Perlin's value noise).
double mottle(double right, double up, std::uint64_t octave) {
  const std::int64_t column = floor_of(right);
  const std::int64_t row = floor_of(up);
  const auto blend = [](double t) { return t * t * (3.0 - 2.0 * t); };
  const double across = blend(right - static_cast<double>(column));
  const double down = blend(up - static_cast<double>(row));
  const auto value = [&](int i, int j) { return lattice_value(column + i, row + j, octave); };
  const double lower = value(0, 0) + across * (value(1, 0) - value(0, 0));
  const double upper = value(0, 1) + across * (value(1, 1) - value(0, 1));
  return 2.0 * (lower + down * (upper - lower)) - 1.0;
}

/// Two octaves, the finer one at half the grain and half the strength, between -1 and 1.
double mottle_at(const Material& material, double right, double up) {
  double sum = 0.0;
  double weight = 2.0 / 3.0;
  double scale = 1.0 / material.mottle_grain_m;
  for (int octave = 0; octave < kMottleOctaves; ++octave) {
    sum += weight * mottle(scale * right, scale * up, static_cast<std::uint64_t>(octave));
    weight *= 0.5;
    scale *= 2.0;
  }
  return sum;
}

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

void look_up(const WoodGrain& grain, double right, double up, Reflection& spot) {
  const double cosine = std::cos(grain.direction_rad);
  const double sine = std::sin(grain.direction_rad);
  const double along = (cosine * right + sine * up) / grain.length_m;
  const double across = (cosine * up - sine * right) / grain.fibre_m;
  // Year rings are wide, fibres fine: two octaves across, both as long.
  const double value = 0.65 * mottle(along, across, kWoodOctave) +
                       0.35 * mottle(along, 2.0 * across, kWoodOctave + 1);
  spot.reflectance = grain.dark + 0.5 * (1.0 + value) * (grain.light - grain.dark);
}

// Each level is a lattice, each of its cells is printed or not; what is printed fills a random part
// of its cell. Finer levels lie over coarser ones.
void look_up(const Poster& poster, double right, double up, Reflection& spot) {
  spot.reflectance = poster.lightest;
  spot.patch = 1;
  double cell_m = poster.cell_m;
  for (std::uint64_t level = 0; level < kPosterLevels; ++level, cell_m *= 0.5) {
    const std::int64_t column = floor_of(right / cell_m);
    const std::int64_t row = floor_of(up / cell_m);
    PixelRandom random(kPosterSeed + static_cast<std::uint64_t>(poster.seed), level,
                       static_cast<std::uint64_t>(column), static_cast<std::uint64_t>(row));
    const double x = right / cell_m - static_cast<double>(column);
    const double y = up / cell_m - static_cast<double>(row);
    const bool is_printed = random.uniform() < kPosterShare;
    const double left = 0.4 * random.uniform();
    const double bottom = 0.4 * random.uniform();
    const double width = 0.5 + (0.5 - left) * random.uniform();
    const double height = 0.5 + (0.5 - bottom) * random.uniform();
    const double grey = random.uniform();
    if (!is_printed || x < left || x >= left + width || y < bottom || y >= bottom + height)
      continue;
    spot.reflectance = poster.darkest + grey * (poster.lightest - poster.darkest);
    spot.patch = 2 + static_cast<int>(random.bits() >> 34U);
  }
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
  const bool is_plain =
      std::holds_alternative<std::monostate>(material.texture) && material.mottle_contrast == 0.0;
  if (is_plain) return spot;
  const Eigen::Vector3d offset = point - facet.center;
  const double right = facet.right.dot(offset);
  const double up = facet.up.dot(offset);
  std::visit([&](const auto& texture) { look_up(texture, right, up, spot); }, material.texture);
  if (material.mottle_contrast > 0.0) {
    spot.reflectance *= 1.0 + material.mottle_contrast * mottle_at(material, right, up);
  }
  return spot;
}

Shading::Shading(const Scene& scene, const World& world) : scene_(scene), world_(world) {
  const BandPass& filter = scene.imager.filter;
  daylight_scale_ = electrons_per_radiance(scene.imager, filter.center_nm) * filter.width_nm *
                    scene.imager.shutter_s;
  for (const SimulatedLaser& laser : scene.lasers) {
    laser_scale_.push_back(electrons_per_radiance(scene.imager, laser.wavelength_nm));
  }
  for (const Facet& facet : world.facets()) {
    const Eigen::Vector3d normal =
        facet.normal.dot(facet.center) > 0.0 ? Eigen::Vector3d(-facet.normal) : facet.normal;
    FacetLight& light = facets_.emplace_back(light_on(normal));
    light.material = &scene.objects[static_cast<std::size_t>(facet.object)].material;
    light.own_radiance = light.material->radiance_w_m2_sr_nm;
  }
}

Shading::FacetLight Shading::light_on(const Eigen::Vector3d& normal) const noexcept {
  const Daylight& daylight = scene_.daylight;
  FacetLight light;
  const double sky_share = 0.5 * (1.0 + normal.dot(world_.up()));
  light.diffuse_w_m2_nm = daylight.ambient_w_m2_nm + daylight.sky_w_m2_nm * sky_share;
  light.sun_w_m2_nm = daylight.sun_w_m2_nm * std::max(0.0, normal.dot(world_.to_sun()));
  return light;
}

Reflection Shading::reflection(const Hit& hit, const Eigen::Vector3d& point) const noexcept {
  return reflection_at(*facets_[static_cast<std::size_t>(hit.facet)].material,
                       world_.facet(hit.facet), point);
}

double Shading::falloff(const Eigen::Vector3d& ray) const noexcept {
  if (scene_.imager.falloff_exponent == 0.0) return 1.0;
  return std::pow(ray.z() / ray.norm(), scene_.imager.falloff_exponent);
}

double Shading::daylight_electrons(const Hit& hit, const Eigen::Vector3d& ray,
                                   const Reflection& spot,
                                   std::span<const int> casters) const noexcept {
  const double scale = daylight_scale_ * falloff(ray);
  if (!hit.found()) return scale * scene_.daylight.sky_radiance_w_m2_sr_nm;
  const Eigen::Vector3d point = hit.t * ray;
  const Facet& facet = world_.facet(hit.facet);
  const FacetLight& flat = facets_[static_cast<std::size_t>(hit.facet)];
  double diffuse = flat.diffuse_w_m2_nm;
  double sun = flat.sun_w_m2_nm;
  if (facet.kind == Facet::Kind::kTube) {
    const FacetLight round = light_on(world_.normal_to_camera(hit.facet, point));
    diffuse = round.diffuse_w_m2_nm;
    sun = round.sun_w_m2_nm;
  }
  const double away_from_light = spot.brdf(-1.0);
  double radiance = flat.own_radiance + diffuse * away_from_light;
  if (sun > 0.0 && !world_.in_shade(point, casters)) {
    radiance +=
        sun * (spot.retro_gain == 0.0 ? away_from_light
                                      : spot.brdf(-world_.to_sun().dot(point) / point.norm()));
  }
  return scale * radiance;
}

double Shading::electrons_per_fluence(const Reflection& spot, const Eigen::Vector3d& point,
                                      const Eigen::Vector3d& origin, int laser) const noexcept {
  const double cos_angle =
      spot.retro_gain == 0.0 ? 1.0 : (origin - point).normalized().dot(-point.normalized());
  return laser_scale_[static_cast<std::size_t>(laser)] * falloff(point) * spot.brdf(cos_angle);
}

}  // namespace striper::detail
