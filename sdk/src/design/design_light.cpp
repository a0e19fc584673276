// SPDX-License-Identifier: Apache-2.0
// The light budget of a design and what its noise makes of it.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>

#include <striper/core/frame.hpp>
#include <striper/core/statistics.hpp>
#include <striper/design/design_figures.hpp>
#include <striper/stripe/crlb.hpp>

#include "core/pixel_box.hpp"

namespace striper {
namespace {

const double kRootTwoPi = std::sqrt(2.0 * std::numbers::pi);
constexpr double kWhitePaper = 0.85;  // What `StripeLook::amplitude_at` is measured on.
constexpr int kPhases = 8;  // Of the stripe within a pixel, over which errors are averaged.

double photon_energy_j(double wavelength_nm) {
  constexpr double kPlanckTimesLight = 6.62607015e-34 * 299792458.0;  // CODATA 2018, exact.
  return kPlanckTimesLight / (wavelength_nm * 1e-9);
}

// Electrons that one J/(m^2 sr) of a surface puts into a pixel: pi A T QE / (4 N^2) / photon.
double electrons_per_radiance(const DesignCamera& camera, double wavelength_nm) {
  const double area_m2 = camera.pixel_pitch_m * camera.pixel_pitch_m;
  return std::numbers::pi / (4.0 * camera.f_number * camera.f_number) * camera.lens_transmission *
         camera.filter_transmission * area_m2 * camera.quantum_efficiency /
         photon_energy_j(wavelength_nm);
}

NoiseModel noise_of(const StriperDesign& design) {
  if (design.model.noise) return *design.model.noise;
  const DesignCamera& camera = design.camera;
  return {camera.read_noise_e * camera.dn_per_electron, camera.dn_per_electron,
          camera.black_level_dn};
}

// The same where a dark exposure with this background is subtracted: its noise adds to the read
// noise of every pixel.
NoiseModel with_dark(const NoiseModel& noise, double background_dn) {
  NoiseModel sum = noise;
  const double dark2 = noise.variance_dn2(noise.black_level_dn + background_dn);
  sum.read_noise_dn = std::sqrt(noise.read_noise_dn * noise.read_noise_dn + dark2);
  return sum;
}

// A Gaussian over sensor rows as the rows of a field sample it: every other row, each a row high.
StripeProfile in_lines(double width_px, double amplitude_dn, int pitch) {
  StripeProfile profile;
  const double effective2 = (width_px * width_px + detail::kPixelBox2) / (pitch * pitch);
  profile.sigma_px = std::sqrt(std::max(effective2 - detail::kPixelBox2, 1e-4));
  profile.amplitude_dn = amplitude_dn * width_px / pitch / profile.sigma_px;
  return profile;
}

// The response of a matched filter in sigmas of its own noise, with the background's height and
// slope unknown.
double matched_response(const StripeProfile& profile, int half, double noise_dn) {
  const int count = 2 * half + 1;
  Eigen::VectorXd shape(count);
  Eigen::MatrixXd nuisance(count, 2);
  for (int i = -half; i <= half; ++i) {
    shape[i + half] = profile.value_dn(i) - profile.background_dn;
    nuisance.row(i + half) << 1.0, i;
  }
  const Eigen::VectorXd known = nuisance * nuisance.colPivHouseholderQr().solve(shape);
  return (shape - known).norm() / noise_dn;
}

// Straight between knots over the logarithms, which a power of the range is exact in; beyond them
// the nearest two go on.
template <typename Knots, typename Value>
double interpolated(const Knots& knots, double range_m, Value value) {
  std::size_t i = 0;
  while (i + 2 < knots.size() && knots[i + 1].range_m < range_m) ++i;
  const double low = std::log(knots[i].range_m);
  const double part = (std::log(range_m) - low) / (std::log(knots[i + 1].range_m) - low);
  return std::exp((1.0 - part) * std::log(value(knots[i])) + part * std::log(value(knots[i + 1])));
}

double sun_fluence_j_m2(const StriperDesign& design) {
  return design.sun.filtered_w_m2(design.camera.filter_width_nm) * design.camera.shutter_s;
}

}  // namespace

struct DesignFigures::Light {
  double amplitude_dn;    // Of the stripe's Gaussian, lens blur included.
  double sharp_dn;        // The same without the blur: what the ratio to the sun is of.
  double width_px;        // Of the stripe's Gaussian, sensor pixels.
  double laser_over_sun;  // On the surface.
};

double DesignFigures::thickness_sigma_m(double distance_m) const {
  const DesignLaser& laser = design_.laser;
  return std::hypot(laser.waist_m, laser.thickness_rad * (distance_m - laser.focus_m)) / kRootTwoPi;
}

double DesignFigures::laser_fluence_j_m2(double distance_m) const {
  const DesignLaser& laser = design_.laser;
  const double energy_j =
      laser.power_w ? *laser.power_w * design_.camera.shutter_s : laser.pulse_energy_j;
  return energy_j / (laser.fan_rad * distance_m * kRootTwoPi * thickness_sigma_m(distance_m));
}

double DesignFigures::laser_to_sun(double range_m) const {
  const DesignLaser& laser = design_.laser;
  const Eigen::Vector3d p_cam = triangulator_.T_cam_scan() * Eigen::Vector3d(range_m, 0.0, 0.0);
  const double per_pulse = laser_fluence_j_m2((p_cam - laser.origin_cam).norm());
  const double mean_w_m2 =
      laser.power_w ? per_pulse / design_.camera.shutter_s : per_pulse * design_.camera.rate_hz;
  return mean_w_m2 / design_.sun.total_w_m2;
}

DesignFigures::Light DesignFigures::light_by_optics(const Eigen::Vector3d& p_cam,
                                                    const Eigen::Vector2d& pixel) const {
  const Eigen::Vector3d to_laser = design_.laser.origin_cam - p_cam;
  const Eigen::Vector3d normal = to_laser.normalized();
  // How far from the laser plane one pixel more across the stripe is, on a surface that faces the
  // laser.
  const Eigen::Vector2d half = design_.model.axis == StripeAxis::kColumns
                                   ? Eigen::Vector2d(0.0, 0.5)
                                   : Eigen::Vector2d(0.5, 0.0);
  const CameraModel& camera = design_.model.camera;
  const Eigen::Vector2d change =
      camera.unproject(pixel + half).xy - camera.unproject(pixel - half).xy;
  const Eigen::Vector3d ray = p_cam / p_cam.z();
  const Eigen::Vector3d step(change.x(), change.y(), 0.0);
  const Eigen::Vector3d& across = triangulator_.plane().normal();
  const double height_m = p_cam.z() * across.dot(step - normal.dot(step) / normal.dot(ray) * ray);

  Light light{};
  const double thickness_px = thickness_sigma_m(to_laser.norm()) / std::abs(height_m);
  light.width_px = std::hypot(thickness_px, design_.camera.blur_sigma_px);
  const double fluence = laser_fluence_j_m2(to_laser.norm());
  const double falloff = std::pow(p_cam.z() / p_cam.norm(), design_.camera.falloff_exponent);
  light.sharp_dn = design_.camera.dn_per_electron * fluence * design_.reflectance /
                   std::numbers::pi * falloff *
                   electrons_per_radiance(design_.camera, design_.laser.wavelength_nm);
  light.amplitude_dn = light.sharp_dn * thickness_px / light.width_px;
  light.laser_over_sun = fluence / sun_fluence_j_m2(design_);
  return light;
}

DesignFigures::Light DesignFigures::light_by_look(const Eigen::Vector3d& p_cam,
                                                  double range_m) const {
  const StripeLook& look = design_.model.lasers[static_cast<std::size_t>(design_.laser_index)].look;
  Light light{};
  light.sharp_dn = design_.reflectance / kWhitePaper *
                   interpolated(look.amplitude_at, range_m,
                                [](const StripeLook::AmplitudeAt& k) { return k.amplitude_dn; });
  light.amplitude_dn = light.sharp_dn;
  light.width_px = look.width_at.size() > 1
                       ? interpolated(look.width_at, range_m,
                                      [](const StripeLook::WidthAt& k) { return k.width_px; })
                       : *look.width_px;
  light.laser_over_sun =
      laser_fluence_j_m2((p_cam - design_.laser.origin_cam).norm()) / sun_fluence_j_m2(design_);
  return light;
}

DesignFigures::Light DesignFigures::light_at(const Eigen::Vector3d& p_cam,
                                             const Eigen::Vector2d& pixel) const {
  const StripeLook& look = design_.model.lasers[static_cast<std::size_t>(design_.laser_index)].look;
  const bool is_measured =
      look.amplitude_at.size() > 1 && (look.width_px || look.width_at.size() > 1);
  return is_measured ? light_by_look(p_cam, (triangulator_.T_cam_scan().inverse() * p_cam).norm())
                     : light_by_optics(p_cam, pixel);
}

void DesignFigures::add_errors(const Eigen::Vector2d& pixel, RangeFigures& figures) const {
  const PlanePoint place = triangulator_.triangulate(pixel);
  const Light light =
      light_at(triangulator_.T_cam_scan() * Eigen::Vector3d(place.x_m, place.y_m, 0.0), pixel);
  figures.signal_dn = light.amplitude_dn;
  figures.signal_to_background = light.laser_over_sun;
  figures.width_px = light.width_px;
  const bool is_dark = std::isinf(light.laser_over_sun) || light.sharp_dn == 0.0;
  figures.background_dn = is_dark ? 0.0 : light.sharp_dn / light.laser_over_sun;

  const NoiseModel single = noise_of(design_);
  const NoiseModel noise =
      design_.camera.dark_subtracted ? with_dark(single, figures.background_dn) : single;
  StripeProfile profile = in_lines(light.width_px, light.amplitude_dn, line_pitch());
  profile.background_dn = noise.black_level_dn + figures.background_dn;
  const double noise_dn = std::sqrt(noise.variance_dn2(profile.background_dn));
  figures.snr = light.amplitude_dn / noise_dn;

  CrlbOptions options;
  options.noise = noise;
  options.full_scale_dn = full_scale_dn(design_.camera.bit_depth);
  options.slope_is_known = false;
  const int half = static_cast<int>(std::ceil(7.0 * profile.sigma_px)) + 6;
  options.first_pixel = -half;
  options.last_pixel = half;
  figures.is_clipped = profile.value_dn(0) >= options.full_scale_dn;
  double variance = 0.0;
  double response = 0.0;
  for (int n = 0; n < kPhases; ++n) {
    profile.position_px = (n + 0.5) / kPhases - 0.5;
    variance += std::pow(crlb_sigma_px(profile, options), 2) / kPhases;
    response += matched_response(profile, half, noise_dn) / kPhases;
  }
  figures.row_sigma_px = std::sqrt(variance) * line_pitch();
  figures.sigma_m = std::sqrt(variance) * figures.step_derivative_m;
  figures.detection = normal_above(threshold_sigmas_ - response);
}

}  // namespace striper
