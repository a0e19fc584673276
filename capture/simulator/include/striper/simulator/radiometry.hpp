// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/simulator/scene.hpp>

namespace striper {

// The light budget of a scene in closed form: what the simulator renders with, and what a person
// checks it by. All functions are pure and thread-safe.

/// Energy of one photon, joules.
double photon_energy_j(double wavelength_nm) noexcept;

/// Standard deviation of a laser plane's thickness at a distance from the laser, metres.
double thickness_sigma_m(const SimulatedLaser& laser, double distance_m) noexcept;

/// Fluence of one pulse in the middle of the laser plane, on a surface that faces the laser, J/m^2.
double peak_fluence_j_m2(const SimulatedLaser& laser, double distance_m) noexcept;

/// Fluence of the sun during one shutter time within the filter's band, on a surface that faces the
/// sun, before the filter, J/m^2.
double sun_fluence_j_m2(const Scene& scene) noexcept;

/// Electrons that one unit of time-integrated radiance (J/(m^2 sr), in the filter's band) puts into
/// a pixel on the optical axis: pi A T_lens T_filter QE / (4 N^2) / photon energy.
double electrons_per_radiance(const Imager& imager, double wavelength_nm) noexcept;

/// The paper's signal to background: peak fluence of the laser over fluence of the sun, for a
/// surface that faces both.
double stripe_to_sun_ratio(const Scene& scene, int laser, double distance_m);

}  // namespace striper
