// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include <striper/design/striper_design.hpp>

#include "design/bounds.hpp"

namespace striper {
namespace {

using detail::require_at_least;
using detail::require_between;

constexpr double kTiny = 1e-9;  // Above 0, and no unit that anything is built in.

CameraModel centred_camera(int columns, int rows, double focal_px, LensModel lens) {
  require_between("columns", columns, 8, 32768);
  require_between("rows", rows, 8, 32768);
  return CameraModel(columns, rows, focal_px, focal_px, 0.5 * (columns - 1), 0.5 * (rows - 1), lens,
                     std::vector<double>(static_cast<std::size_t>(distortion_count(lens)), 0.0));
}

void validate(const DesignLaser& laser) {
  require_between("laser.fan_rad", laser.fan_rad, 1e-6, std::numbers::pi);
  require_between("laser.thickness_rad", laser.thickness_rad, 0.0, 1.0);
  require_between("laser.waist_m", laser.waist_m, laser.thickness_rad > 0.0 ? 0.0 : kTiny, 1.0);
  require_between("laser.wavelength_nm", laser.wavelength_nm, 300.0, 1100.0);
  require_at_least("laser.pulse_energy_j", laser.pulse_energy_j, 0.0);
  require_between("laser.pulse_s", laser.pulse_s, 1e-13, 0.25);
  if (laser.power_w) require_at_least("laser.power_w", *laser.power_w, 0.0);
}

void validate(const DesignCamera& camera) {
  require_between("camera.pixel_pitch_m", camera.pixel_pitch_m, 1e-7, 1e-3);
  require_between("camera.f_number", camera.f_number, 0.3, 100.0);
  require_between("camera.lens_transmission", camera.lens_transmission, kTiny, 1.0);
  require_between("camera.filter_transmission", camera.filter_transmission, kTiny, 1.0);
  require_between("camera.filter_width_nm", camera.filter_width_nm, 0.1, 1000.0);
  require_between("camera.quantum_efficiency", camera.quantum_efficiency, kTiny, 1.0);
  require_between("camera.blur_sigma_px", camera.blur_sigma_px, 0.0, 100.0);
  require_between("camera.rate_hz", camera.rate_hz, 1e-3, 1e6);
  require_between("camera.shutter_s", camera.shutter_s, kTiny, 1.0 / camera.rate_hz);
  require_between("camera.bit_depth", camera.bit_depth, 8, 16);
  require_between("camera.dn_per_electron", camera.dn_per_electron, kTiny, 1e6);
  require_between("camera.read_noise_e", camera.read_noise_e, 0.0, 1e6);
  require_between("camera.black_level_dn", camera.black_level_dn, 0.0,
                  std::exp2(camera.bit_depth) - 2.0);
}

}  // namespace

void StriperDesign::validate() const {
  model.validate();
  striper::validate(laser);
  striper::validate(camera);
  require_between("sun.total_w_m2", sun.total_w_m2, 0.0, 1e5);
  require_between("sun.spectral_w_m2_nm", sun.spectral_w_m2_nm, 0.0, 1e3);
  if (sun.suppression) require_between("sun.suppression", *sun.suppression, 1.0, 1e9);
  require_between("reflectance", reflectance, kTiny, 1.0);
  require_between("false_alarm", false_alarm, 1e-9, 0.5);
  require_between("detection", detection, 0.01, 0.9999);
}

CameraModel equiangular_camera(int columns, int rows, double fov_rad) {
  require_between("fov_rad", fov_rad, 1e-3, 3.1);
  return centred_camera(columns, rows, columns / fov_rad, LensModel::kEquidistant);
}

CameraModel pinhole_camera(int columns, int rows, double focal_m, double sensor_width_m) {
  require_between("focal_m", focal_m, 1e-4, 10.0);
  require_between("sensor_width_m", sensor_width_m, 1e-4, 1.0);
  return centred_camera(columns, rows, columns * focal_m / sensor_width_m, LensModel::kPlumbBob);
}

StriperDesign place_laser(const CameraModel& camera, double baseline_m, double tilt_rad) {
  require_between("baseline_m", baseline_m, 1e-3, 100.0);
  require_between("tilt_rad", tilt_rad, -1.5, 1.5);
  // Downwards and forwards as a camera that looks down by the tilt sees them.
  const Eigen::Vector3d down(0.0, std::cos(tilt_rad), std::sin(tilt_rad));
  const Eigen::Vector3d forward(0.0, -std::sin(tilt_rad), std::cos(tilt_rad));
  StriperDesign design;
  design.model.camera = camera;
  design.model.lasers = {Laser{LaserPlane(down, baseline_m), {}, {}}};
  design.laser.origin_cam = baseline_m * down;
  design.laser.axis_cam = forward;
  return design;
}

}  // namespace striper
