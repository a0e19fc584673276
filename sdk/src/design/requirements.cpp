// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/units.hpp>
#include <striper/design/design_figures.hpp>
#include <striper/design/eye_safety.hpp>

namespace striper {
namespace {

using Standing = Requirement::Standing;

Standing met(bool is_met) { return is_met ? Standing::kMet : Standing::kNotMet; }

std::string metres(double distance_m) {
  return std::isinf(distance_m) ? "the horizon" : fmt::format("{:.2f} m", distance_m);
}

Requirement sunlight(const DesignFigures& figures) {
  const RangeFigures at = figures.at(2.0);
  return {1, "works in bright sunlight",
          fmt::format("signal to background {:.1f} at 2 m, SNR {:.1f}", at.signal_to_background,
                      at.snr),
          met(at.signal_to_background > 1.0 && at.detection >= figures.design().detection)};
}

Requirement eye_safety(const DesignFigures& figures) {
  const DesignLaser& laser = figures.design().laser;
  EyeSafetyInput input;
  input.wavelength_nm = laser.wavelength_nm;
  input.beam = FanBeam{laser.fan_rad, std::max(laser.thickness_rad, 1e-6)};
  if (laser.power_w)
    input.emission = ContinuousEmission{*laser.power_w};
  else  // A pulse for each scan: two a frame where it is two fields, none for a dark exposure.
    input.emission = PulsedEmission{laser.pulse_energy_j, laser.pulse_s, figures.scan_rate_hz()};
  try {
    const EyeSafetyReport report = assess_eye_safety(input);
    return {2, "safe for eyes",
            fmt::format("class {} where one can touch it; class 1 from {} on",
                        to_string(report.laser_class), metres(report.closest_safe_m)),
            met(report.laser_class == LaserClass::k1)};
  } catch (const Error& error) {
    return {2, "safe for eyes", error.what(), Standing::kNotComputed};
  }
}

Requirement angles(const DesignFigures& figures) {
  const double coverage_deg = figures.coverage_rad(2.0) / kDegree;
  return {3, "a large range of angles (here: 60 degrees)",
          fmt::format("{:.0f} degrees at 2 m", coverage_deg), met(coverage_deg >= 60.0)};
}

Requirement ranges(const DesignFigures& figures) {
  const double farthest_m = figures.max_range_m();
  return {4, "0.5 to 4 m",
          std::isnan(farthest_m)
              ? std::string("the stripe is found nowhere")
              : fmt::format("{} to {}", metres(figures.near_m()), metres(farthest_m)),
          met(figures.near_m() <= 0.5 && farthest_m >= 4.0)};
}

Requirement resolution(const DesignFigures& figures) {
  const RangeFigures at = figures.at(4.0);
  const double angle_deg = figures.angular_resolution_rad() / kDegree;
  const double sigma_percent = 100.0 * at.sigma_m / at.range_m;
  return {5, "a few % of the distance, less than 1 degree",
          fmt::format("{:.2f} degrees; at 4 m a pixel is {:.1f} % and one sigma {:.2f} %",
                      angle_deg, 100.0 * at.step_out_m / at.range_m, sigma_percent),
          met(angle_deg < 1.0 && sigma_percent < 3.0)};
}

Requirement rate(const DesignFigures& figures) {
  const double scans_hz = figures.scan_rate_hz();
  return {9, "20 scans a second or more", fmt::format("{:.0f} scans a second", scans_hz),
          met(scans_hz >= 20.0)};
}

// What a target at 100 km/h moves while the shutter is open, and from scan to scan.
Requirement speed(const DesignFigures& figures) {
  constexpr double kSpeed_m_s = 100.0 / 3.6;
  const double smear_m = kSpeed_m_s * figures.design().camera.shutter_s;
  return {10, "objects at up to 100 km/h",
          fmt::format("{:.2g} mm while the shutter is open, {:.2g} m from scan to scan",
                      1e3 * smear_m, kSpeed_m_s / figures.scan_rate_hz()),
          met(smear_m < figures.at(2.0).step_derivative_m)};
}

}  // namespace

std::vector<Requirement> DesignFigures::requirements() const {
  const double reach_m = design_.laser.origin_cam.norm();
  return {
      sunlight(*this),
      eye_safety(*this),
      angles(*this),
      ranges(*this),
      resolution(*this),
      {6, "cheap", "not computed: what the parts cost", Standing::kNotComputed},
      {7, "small", fmt::format("camera and laser {:.2f} m apart", reach_m), Standing::kNotComputed},
      {8, "robust", "not computed; nothing in it moves", Standing::kNotComputed},
      rate(*this),
      speed(*this)};
}

}  // namespace striper
