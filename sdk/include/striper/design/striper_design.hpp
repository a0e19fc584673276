// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include <striper/model/striper_model.hpp>

namespace striper {

/// The laser of a design: a fan of light, even across it, Gaussian across its plane, as the
/// simulator's. What data sheets call thickness is taken as energy over peak: sqrt(2 pi) sigma.
struct DesignLaser {
  Eigen::Vector3d origin_cam = {0.0, 0.5, 0.0};  ///< Where the fan begins, metres.
  Eigen::Vector3d axis_cam = {0.0, 0.0, 1.0};    ///< Middle of the fan; unit length.
  double fan_rad = 1.0471975511965976;           ///< 60 degrees.
  double thickness_rad = 0.006981317007977318;   ///< .4 degrees.
  double waist_m = 0.0;                          ///< Thickness at the waist, which adds in squares.
  double focus_m = 0.0;                          ///< Distance of the waist from the origin.
  double wavelength_nm = 900.0;
  double pulse_energy_j = 10.4e-6;  ///< Within every shutter opening.
  double pulse_s = 1e-6;            ///< For the laser's class alone.
  std::optional<double> power_w;    ///< Of a steady laser, instead of pulses.
};

/// What turns light into numbers. An input, like all of a design: nothing of it is derived.
struct DesignCamera {
  double pixel_pitch_m = 9.9e-6;
  double f_number = 1.4;
  double lens_transmission = 0.9;
  double filter_transmission = 0.8;
  double filter_width_nm = 25.0;
  double quantum_efficiency = 0.3;
  double falloff_exponent = 0.0;  ///< Light falls with cos(theta)^this.
  double blur_sigma_px = 0.0;     ///< Lens blur, a Gaussian, sensor pixels.
  double shutter_s = 1.0 / 400000.0;
  double rate_hz = 30.0;         ///< Frames a second.
  bool interlaced = false;       ///< Each frame is two fields of every other row, each a scan.
  bool dark_subtracted = false;  ///< Every other exposure is dark and subtracted from the lit one.
  int bit_depth = 8;
  double dn_per_electron = 0.05;
  double read_noise_e = 20.0;
  double black_level_dn = 8.0;
};

/// The light that disturbs.
struct DesignSun {
  double total_w_m2 = 856.0;          ///< Unfiltered, on a surface that faces it: the paper's sun.
  double spectral_w_m2_nm = 0.856;    ///< Within the filter's band.
  std::optional<double> suppression;  ///< By which a filter lowers `total_w_m2`, instead.

  /// What the filter leaves, W/m^2.
  double filtered_w_m2(double filter_width_nm) const noexcept {
    return suppression ? total_w_m2 / *suppression : spectral_w_m2_nm * filter_width_nm;
  }
};

/// Everything that a design's figures are made of. The defaults are the striper of Mertz et al.
/// 2002 with a 55 degree lens; see `equiangular_camera`, `place_laser`.
struct StriperDesign {
  StriperModel model;   ///< Camera, the laser's plane, axis; its noise and look where it has them.
  int laser_index = 0;  ///< Which of the model's lasers.
  DesignLaser laser;
  DesignCamera camera;
  DesignSun sun;
  double reflectance = 0.5;  ///< Of the target, Lambert; sun and laser meet it squarely.
  double false_alarm =
      1e-3;                 ///< How often noise alone makes a return in a scan line without stripe.
  double detection = 0.99;  ///< How often the stripe has to be found, for the maximum range.

  /// @throws Error{kBadValue} naming the field, the value and the bound.
  void validate() const;
};

/// A camera with equal angles per pixel, which is how the paper's Table 1 comes out.
/// @param fov_rad from the left edge of the image to the right, above 0, below 3.1.
CameraModel equiangular_camera(int columns, int rows, double fov_rad);

/// A pinhole camera. @param focal_m of the lens. @param sensor_width_m across the columns.
CameraModel pinhole_camera(int columns, int rows, double focal_m, double sensor_width_m);

/// A camera straight above a level laser, as in the paper's Figure 1.
/// @param baseline_m from the laser up to the camera. @param tilt_rad by which the camera looks
/// down.
StriperDesign place_laser(const CameraModel& camera, double baseline_m, double tilt_rad);

}  // namespace striper
