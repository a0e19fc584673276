// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/simulator/radiometry.hpp>

namespace striper {

double photon_energy_j(double wavelength_nm) noexcept {
  constexpr double kPlanckTimesLight = 6.62607015e-34 * 299792458.0;  // CODATA 2018, exact.
  return kPlanckTimesLight / (wavelength_nm * 1e-9);
}

double thickness_sigma_m(const SimulatedLaser& laser, double distance_m) noexcept {
  const double spread_m = laser.divergence_sigma_rad * (distance_m - laser.focus_m);
  return std::sqrt(laser.waist_sigma_m * laser.waist_sigma_m + spread_m * spread_m);
}

double peak_fluence_j_m2(const SimulatedLaser& laser, double distance_m) noexcept {
  const double line_length_m = laser.fan_rad * distance_m;
  const double thickness_m =
      std::sqrt(2.0 * std::numbers::pi) * thickness_sigma_m(laser, distance_m);
  return laser.pulse_energy_j / (line_length_m * thickness_m);
}

double sun_fluence_j_m2(const Scene& scene) noexcept {
  return scene.daylight.sun_w_m2_nm * scene.imager.filter.width_nm * scene.imager.shutter_s;
}

double electrons_per_radiance(const Imager& imager, double wavelength_nm) noexcept {
  const double pixel_area_m2 = imager.pixel_pitch_m * imager.pixel_pitch_m;
  // Irradiance on the sensor of a lens focused far away: pi L T / (4 N^2).
  const double solid_angle = std::numbers::pi / (4.0 * imager.f_number * imager.f_number);
  return solid_angle * imager.lens_transmission * imager.filter.transmission * pixel_area_m2 *
         imager.quantum_efficiency / photon_energy_j(wavelength_nm);
}

double stripe_to_sun_ratio(const Scene& scene, int laser, double distance_m) {
  if (laser < 0 || laser >= static_cast<int>(scene.lasers.size())) {
    throw Error(ErrorKind::kBadValue, fmt::format("laser {} - the scene has lasers 0 to {}", laser,
                                                  static_cast<int>(scene.lasers.size()) - 1));
  }
  return peak_fluence_j_m2(scene.lasers[static_cast<std::size_t>(laser)], distance_m) /
         sun_fluence_j_m2(scene);
}

}  // namespace striper
