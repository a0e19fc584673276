// SPDX-License-Identifier: Apache-2.0
#include "design/design_source.hpp"

#include <cmath>
#include <numbers>
#include <string>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/simulator/scene_yaml.hpp>

namespace striper::program {
namespace {

// The plane of a model's laser is known, not where in it the fan begins: below the camera's foot,
// along the scan frame's x.
StriperDesign design_of(StriperModel model, const std::filesystem::path& path) {
  if (model.lasers.empty())
    throw Error(ErrorKind::kUsage, fmt::format("{} has no laser to design with", path.string()));
  StriperDesign design;
  const Eigen::Isometry3d T_cam_scan = model.T_cam_scan(0);
  design.laser.origin_cam = T_cam_scan.translation();
  design.laser.axis_cam = T_cam_scan.linear().col(0);
  design.model = std::move(model);
  return design;
}

bool is_scene(const std::string& text) {
  return text.rfind("striper_scene:", 0) == 0 || text.find("\nstriper_scene:") != std::string::npos;
}

DesignLaser laser_of(const Scene& scene) {
  const SimulatedLaser& simulated = scene.lasers.front();
  const Eigen::Isometry3d T_cam_laser = scene.T_device_cam().inverse() * simulated.T_device_laser;
  const double to_thickness = std::sqrt(2.0 * std::numbers::pi);
  DesignLaser laser;
  laser.origin_cam = T_cam_laser.translation();
  laser.axis_cam = T_cam_laser.linear().col(0);
  laser.fan_rad = simulated.fan_rad;
  laser.thickness_rad = to_thickness * simulated.divergence_sigma_rad;
  laser.waist_m = to_thickness * simulated.waist_sigma_m;
  laser.focus_m = simulated.focus_m;
  laser.wavelength_nm = simulated.wavelength_nm;
  laser.pulse_energy_j = simulated.pulse_energy_j;
  return laser;
}

DesignCamera camera_of(const Scene& scene) {
  const Imager& imager = scene.imager;
  DesignCamera camera;
  camera.pixel_pitch_m = imager.pixel_pitch_m;
  camera.f_number = imager.f_number;
  camera.lens_transmission = imager.lens_transmission;
  camera.filter_transmission = imager.filter.transmission;
  camera.filter_width_nm = imager.filter.width_nm;
  camera.quantum_efficiency = imager.quantum_efficiency;
  camera.falloff_exponent = imager.falloff_exponent;
  camera.blur_sigma_px = imager.blur_sigma_px;
  camera.shutter_s = imager.shutter_s;
  camera.rate_hz = scene.timing.picture_rate_hz;
  camera.interlaced = scene.timing.scan != ScanMode::kProgressive;
  camera.dark_subtracted = scene.timing.pattern.has_dark();
  camera.bit_depth = imager.bit_depth;
  camera.dn_per_electron = imager.dn_per_electron;
  camera.read_noise_e = imager.noise.read_noise_e;
  camera.black_level_dn = imager.black_level_dn;
  return camera;
}

}  // namespace

StriperDesign design_of(const Scene& scene) {
  if (scene.lasers.empty())
    throw Error(ErrorKind::kUsage, fmt::format("{} has no laser to design with", scene.name));
  StriperDesign design;
  design.model.camera = scene.camera;
  design.model.axis = scene.axis;
  const Eigen::Isometry3d T_cam_laser =
      scene.T_device_cam().inverse() * scene.lasers.front().T_device_laser;
  const Eigen::Vector3d normal = T_cam_laser.linear().col(2);
  design.model.lasers = {Laser{LaserPlane(normal, normal.dot(T_cam_laser.translation())), {}, {}}};
  design.laser = laser_of(scene);
  design.camera = camera_of(scene);
  // All light of the day that falls on what faces the striper.
  design.sun.spectral_w_m2_nm = scene.daylight.sun_w_m2_nm + scene.daylight.ambient_w_m2_nm +
                                0.5 * scene.daylight.sky_w_m2_nm;
  return design;
}

StriperDesign load_design(const std::filesystem::path& path) {
  if (is_scene(read_text_file(path, "a scene or a model"))) return design_of(load_scene(path));
  return design_of(load_model(path), path);
}

}  // namespace striper::program
