// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <fmt/format.h>

#include <striper/core/frame.hpp>
#include <striper/simulator/scene.hpp>

#include "scene/scene_violation.hpp"

namespace striper {
namespace {

constexpr double kAlmostInfinity = 1e12;
// From what a scene holds to what is said: the units of its file.
constexpr double kMicro = 1e6;
constexpr double kDegrees = 180.0 / std::numbers::pi;

[[noreturn]] void refuse(const std::string& field, const std::string& value,
                         const std::string& expected) {
  throw detail::SceneViolation(field, fmt::format("{} - expected {}", value, expected));
}
// To ten digits, so that a change of units and back is not seen.
[[noreturn]] void refuse(const std::string& field, double value, const std::string& expected) {
  refuse(field, fmt::format("{:.10g}", value), expected);
}

void check_range(const std::string& field, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    refuse(field, value, fmt::format("a number from {} to {}", low, high));
  }
}
void check_positive(const std::string& field, double value) {
  if (!(value > 0.0 && value < kAlmostInfinity))
    refuse(field, value, "a number above 0, below 1e12");
}
void check_not_negative(const std::string& field, double value) {
  if (!(value >= 0.0 && value < kAlmostInfinity))
    refuse(field, value, "a number, 0 or above, below 1e12");
}
void check_finite(const std::string& field, const Eigen::Vector3d& value) {
  for (const double element : value) {
    if (!(std::abs(element) < kAlmostInfinity))
      refuse(field, element, "a finite number, below 1e12");
  }
}
void check_pose(const std::string& field, const Eigen::Isometry3d& pose) {
  constexpr double kTolerance = 1e-9;
  check_finite(field + ".position_m", pose.translation());
  const Eigen::Matrix3d R = pose.linear();
  const double error = (R.transpose() * R - Eigen::Matrix3d::Identity()).norm();
  if (!(error < kTolerance) || R.determinant() < 0.0) {
    refuse(field + ".rotation_deg", error, "a rotation matrix (difference of R'R from identity 0)");
  }
}
void check_motion(const std::string& field, const SteadyMotion& motion) {
  check_finite(field + ".velocity_m_s", motion.velocity_m_s);
  check_finite(field + ".angular_velocity_deg_s", kDegrees * motion.angular_velocity_rad_s);
}

// A pixel takes some 50 bytes while it is rendered.
void check_size(const CameraModel& camera) {
  constexpr double kMostPixels = 50e6;
  const double pixels = static_cast<double>(camera.width()) * camera.height();
  if (pixels > kMostPixels) {
    refuse("camera", fmt::format("{}x{} pixels", camera.width(), camera.height()),
           fmt::format("at most {:.0f} million in all", 1e-6 * kMostPixels));
  }
}

void check_region(const Imager& imager, const CameraModel& camera) {
  const cv::Rect sensor(0, 0, camera.width(), camera.height());
  const cv::Rect region = imager.region.empty() ? sensor : imager.region;
  if ((region & sensor) != region) {
    refuse("imager.region",
           fmt::format("[{}, {}, {}, {}]", region.x, region.y, region.width, region.height),
           fmt::format("a part of the sensor, which is {}x{}", sensor.width, sensor.height));
  }
  const cv::Size bin = imager.binning;
  if (bin.width < 1 || bin.height < 1 || region.width % bin.width != 0 ||
      region.height % bin.height != 0) {
    refuse("imager.binning", fmt::format("[{}, {}]", bin.width, bin.height),
           fmt::format("divisors of the image's size, {}x{}", region.width, region.height));
  }
}

void check_imager(const Imager& imager) {
  check_positive("imager.pixel_pitch_um", kMicro * imager.pixel_pitch_m);
  check_positive("imager.f_number", imager.f_number);
  check_range("imager.lens_transmission", imager.lens_transmission, 0.0, 1.0);
  check_range("imager.falloff_exponent", imager.falloff_exponent, 0.0, 8.0);
  check_range("imager.blur_px", imager.blur_sigma_px, 0.0, 20.0);
  check_range("imager.quantum_efficiency", imager.quantum_efficiency, 0.0, 1.0);
  check_positive("imager.filter.center_nm", imager.filter.center_nm);
  check_positive("imager.filter.width_nm", imager.filter.width_nm);
  check_range("imager.filter.transmission", imager.filter.transmission, 0.0, 1.0);
  check_range("imager.shutter_us", kMicro * imager.shutter_s, 1e-6, 1e9);
  check_range("imager.bits", imager.bit_depth, 8, 16);
  check_positive("imager.dn_per_electron", imager.dn_per_electron);
  check_range("imager.black_level_dn", imager.black_level_dn, 0.0, full_scale_dn(imager.bit_depth));
  check_not_negative("imager.full_well_e", imager.full_well_e);
  check_range("imager.bloom.fraction", imager.bloom.fraction, 0.0, 1.0);
  check_range("imager.bloom.sigma_px", imager.bloom.sigma_px, 0.0, 100.0);
  check_not_negative("noise.read_e", imager.noise.read_noise_e);
  check_range("noise.prnu", imager.noise.prnu, 0.0, 0.3);
  check_range("noise.speckle", imager.noise.speckle, 0.0, 1.0);
}

void check_laser(const std::string& field, const SimulatedLaser& laser, const BandPass& filter) {
  check_pose(field, laser.T_device_laser);
  check_positive(field + ".fan_deg", kDegrees * laser.fan_rad);
  if (laser.fan_rad >= std::numbers::pi) {
    refuse(field + ".fan_deg", kDegrees * laser.fan_rad, "less than a half turn, 180");
  }
  const double thickness_mm = laser.waist_sigma_m / SimulatedLaser::thickness_to_sigma(1e-3);
  const double thickness_deg =
      kDegrees * laser.divergence_sigma_rad / SimulatedLaser::thickness_to_sigma(1.0);
  check_not_negative(field + ".thickness_mm", thickness_mm);
  check_not_negative(field + ".thickness_deg", thickness_deg);
  if (thickness_mm == 0.0 && thickness_deg == 0.0) {
    refuse(field + ".thickness_deg", 0.0, "more than 0, or a thickness_mm that is");
  }
  check_not_negative(field + ".focus_m", laser.focus_m);
  if (laser.waist_sigma_m == 0.0 && laser.focus_m > 0.0) {
    refuse(field + ".focus_m", laser.focus_m,
           "0, or a thickness_mm above 0: a focus of no thickness is infinitely bright");
  }
  check_not_negative(field + ".pulse_uj", kMicro * laser.pulse_energy_j);
  if (std::abs(laser.wavelength_nm - filter.center_nm) > 0.5 * filter.width_nm) {
    refuse(field + ".wavelength_nm", laser.wavelength_nm,
           fmt::format("a wavelength that the filter lets pass, {} to {}",
                       filter.center_nm - 0.5 * filter.width_nm,
                       filter.center_nm + 0.5 * filter.width_nm));
  }
}

struct ShapeCheck {
  std::string field;

  void operator()(const Plane&) const {}
  void operator()(const Rectangle& shape) const {
    check_positive(field + ".size_m", shape.width_m);
    check_positive(field + ".size_m", shape.height_m);
  }
  void operator()(const Disc& shape) const { check_positive(field + ".radius_m", shape.radius_m); }
  void operator()(const Box& shape) const {
    for (const double size : shape.size_m) check_positive(field + ".size_m", size);
  }
  void operator()(const Cylinder& shape) const {
    check_positive(field + ".radius_m", shape.radius_m);
    check_positive(field + ".length_m", shape.length_m);
  }
  void operator()(const Sweep& shape) const {
    check_positive(field + ".length_m", shape.length_m);
    if (shape.profile_m.size() < 2) {
      refuse(field + ".profile_m", static_cast<double>(shape.profile_m.size()),
             "at least two points");
    }
    for (std::size_t i = 1; i < shape.profile_m.size(); ++i) {
      const double apart_m = (shape.profile_m[i] - shape.profile_m[i - 1]).norm();
      if (apart_m > 0.0 && apart_m < kAlmostInfinity) continue;
      refuse(field + ".profile_m",
             fmt::format("points {} and {}, {:.10g} m apart", i - 1, i, apart_m),
             "points that are apart, by finite lengths");
    }
  }
};

void check_texture(const std::string&, std::monostate) {}
void check_texture(const std::string& field, const Checkerboard& board) {
  check_range(field + ".checkerboard.columns", board.columns, 1, 1000);
  check_range(field + ".checkerboard.rows", board.rows, 1, 1000);
  check_positive(field + ".checkerboard.square_m", board.square_m);
  check_not_negative(field + ".checkerboard.border_m", board.border_m);
  check_range(field + ".checkerboard.black", board.black, 0.0, 1.0);
  check_range(field + ".checkerboard.white", board.white, 0.0, 1.0);
}
void check_texture(const std::string& field, const PaintedStripe& stripe) {
  check_positive(field + ".stripe.width_m", stripe.width_m);
  check_not_negative(field + ".stripe.dash_m", stripe.dash_m);
  check_not_negative(field + ".stripe.gap_m", stripe.gap_m);
  check_range(field + ".stripe.reflectance", stripe.reflectance, 0.0, 1.0);
  check_range(field + ".stripe.wear", stripe.wear, 0.0, 1.0);
  check_positive(field + ".stripe.grain_m", stripe.grain_m);
  check_not_negative(field + ".stripe.retro.gain", stripe.retro_gain);
  check_positive(field + ".stripe.retro.spread_deg", kDegrees * stripe.retro_spread_rad);
}
void check_texture(const std::string& field, const WoodGrain& grain) {
  check_positive(field + ".wood.fibre_m", grain.fibre_m);
  check_positive(field + ".wood.length_m", grain.length_m);
  check_range(field + ".wood.direction_deg", kDegrees * grain.direction_rad, -360.0, 360.0);
  check_range(field + ".wood.dark", grain.dark, 0.0, 1.0);
  check_range(field + ".wood.light", grain.light, 0.0, 1.0);
}
void check_texture(const std::string& field, const Poster& poster) {
  check_positive(field + ".poster.cell_m", poster.cell_m);
  check_range(field + ".poster.darkest", poster.darkest, 0.0, 1.0);
  check_range(field + ".poster.lightest", poster.lightest, 0.0, 1.0);
  check_range(field + ".poster.seed", poster.seed, 0.0, 1e9);
}

void check_object(const std::string& field, const SceneObject& object) {
  std::visit(ShapeCheck{field}, object.shape);
  const Material& material = object.material;
  check_range(field + ".reflectance", material.reflectance, 0.0, 1.0);
  check_not_negative(field + ".retro.gain", material.retro_gain);
  check_positive(field + ".retro.spread_deg", kDegrees * material.retro_spread_rad);
  check_not_negative(field + ".radiance_w_m2_sr_nm", material.radiance_w_m2_sr_nm);
  check_range(field + ".mottle.contrast", material.mottle_contrast, 0.0, 1.0);
  check_positive(field + ".mottle.grain_m", material.mottle_grain_m);
  std::visit([&](const auto& texture) { check_texture(field, texture); }, material.texture);
  check_pose(field, object.T_world_object);
  check_motion(field, object.motion);
}

// Both fields of a frame are of one Frame, which has one exposure; and none is longer than its
// turn.
void check_bracket(const Timing& timing) {
  const IlluminationPattern& pattern = timing.pattern;
  if (!pattern.is_bracket()) return;
  const bool has_two = timing.scan == ScanMode::kTopFirst || timing.scan == ScanMode::kBottomFirst;
  const double longest_us = timing.longest_exposure_us();
  for (std::uint64_t n = 0; n < 2 * pattern.entries().size(); ++n) {
    const double exposure_us = pattern.exposure_us_at(n);
    if (exposure_us > longest_us) {
      refuse("timing.cadence", fmt::format("'{}'", pattern.to_string()),
             fmt::format("exposures of at most {:.6g} us, at this frame rate", longest_us));
    }
    if (has_two && n % 2 == 1 && exposure_us != pattern.exposure_us_at(n - 1)) {
      refuse("timing.cadence", fmt::format("'{}'", pattern.to_string()),
             "exposures as long as each other in the two fields of a frame");
    }
  }
}

void check_timing(const Timing& timing, std::size_t lasers) {
  if (lasers == 0) refuse("lasers", "[]", "one laser at least");
  check_range("timing.picture_rate_hz", timing.picture_rate_hz, 1e-3, 1e6);
  if (timing.pattern.is_automatic()) {
    refuse("timing.cadence", "'auto'", "what the lasers do, such as '0' or '0,dark'");
  }
  for (const Illumination entry : timing.pattern.entries()) {
    if (entry.is_lit() && static_cast<std::size_t>(entry.laser_index()) >= lasers) {
      refuse("timing.cadence", fmt::format("'{}'", timing.pattern.to_string()),
             fmt::format("laser indices below {}, the number of lasers", lasers));
    }
  }
  check_bracket(timing);
}

void check_daylight(const Daylight& light) {
  check_not_negative("daylight.sun_w_m2_nm", light.sun_w_m2_nm);
  check_not_negative("daylight.sky_w_m2_nm", light.sky_w_m2_nm);
  check_not_negative("daylight.ambient_w_m2_nm", light.ambient_w_m2_nm);
  check_not_negative("daylight.sky_radiance_w_m2_sr_nm", light.sky_radiance_w_m2_sr_nm);
  check_finite("daylight.sun_direction", light.sun_direction);
  check_positive("daylight.sun_direction", light.sun_direction.norm());
}

}  // namespace

void Scene::validate() const {
  check_imager(imager);
  check_size(camera);
  check_region(imager, camera);
  Eigen::Isometry3d mounting = Eigen::Isometry3d::Identity();
  mounting.linear() = camera_rotation;
  check_pose("camera", mounting);
  check_pose("device", T_world_device);
  check_motion("device", device_motion);
  for (std::size_t i = 0; i < lasers.size(); ++i) {
    check_laser(fmt::format("lasers[{}]", i), lasers[i], imager.filter);
  }
  check_timing(timing, lasers.size());
  check_daylight(daylight);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    check_object(fmt::format("objects[{}]", i), objects[i]);
  }
  check_range("edge_distance_px", edge_distance_px, 0, 100);
}

}  // namespace striper
