// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <striper/core/illumination_pattern.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/model/camera_model.hpp>
#include <striper/simulator/imager.hpp>
#include <striper/simulator/scene_object.hpp>
#include <striper/simulator/simulated_laser.hpp>

namespace striper {

/// How the camera scans a frame.
enum class ScanMode {
  kProgressive,
  kTopFirst,              ///< Interlaced, two fields in one frame, the top one first.
  kBottomFirst,           ///< The same, the bottom one first.
  kAlternateTopFirst,     ///< Interlaced, a frame per field, the top one first.
  kAlternateBottomFirst,  ///< The same, the bottom one first.
};

struct Timing {
  double picture_rate_hz = 30.0;
  ScanMode scan = ScanMode::kProgressive;  ///< Fields are half a frame period apart.
  IlluminationPattern pattern =
      IlluminationPattern({Illumination::laser(0)});  ///< Never automatic.

  /// The longest that an exposure can be: until the next one begins.
  double longest_exposure_us() const {
    return (scan == ScanMode::kProgressive ? 1e6 : 5e5) / picture_rate_hz;
  }
};

/// Daylight. The spectral irradiances are those in the filter's band; the paper's sun is 856 W/m^2
/// over 1000 nm.
struct Daylight {
  double sun_w_m2_nm = 0.0;  ///< On a surface that faces the sun.
  /// Towards the sun, world frame; need not be normalised.
  Eigen::Vector3d sun_direction = Eigen::Vector3d(-0.3, 0.4, 0.86);
  bool shadows = true;
  double sky_w_m2_nm = 0.0;      ///< From the whole sky on a surface that faces up; half on a wall.
  double ambient_w_m2_nm = 0.0;  ///< On every surface alike: indoor light.
  double sky_radiance_w_m2_sr_nm = 0.0;  ///< Where the camera sees no object.
};

/// Everything that the simulator needs to know, all of it with defaults: an empty scene seen by the
/// paper's striper (Mertz et al. 2002), a 55 degree camera 0.5 m above a level 60 degree laser.
///
/// World frame: x forward, y left, z up. The device's frame has its origin in the camera's centre
/// and the same axes; the camera looks along the device's x, turned by `camera_rotation`.
struct Scene {
  std::string name = "scene";  ///< For messages: the file that it came from.

  CameraModel camera = pinhole(640, 480, 55.0);
  /// Rotation of the camera on the device; identity looks along x with the image upright.
  Eigen::Matrix3d camera_rotation = Eigen::Matrix3d::Identity();
  Eigen::Isometry3d T_world_device = Eigen::Isometry3d::Identity();  ///< At time zero.
  SteadyMotion device_motion;

  StripeAxis axis = StripeAxis::kColumns;
  std::vector<SimulatedLaser> lasers = {SimulatedLaser{}};
  Imager imager;
  Timing timing;
  Daylight daylight;
  std::vector<SceneObject> objects;

  std::uint64_t seed = 1;    ///< Of every noise.
  int edge_distance_px = 4;  ///< Truth calls a return `near_edge` within this many pixels.

  /// A wall that faces the default striper squarely at `distance_m` from the camera, no daylight.
  ///
  /// The camera is level, so depth is the same all over the wall and the stripe's profile in the
  /// image is a Gaussian exactly, with its centre where d = s cot(alpha) has it.
  static Scene flat_wall(double distance_m);

  /// A camera without distortion. @param fov_deg from the left edge of the image to the right.
  static CameraModel pinhole(int width, int height, double fov_deg);
  /// A camera with equal angles per pixel (equidistant lens).
  static CameraModel fisheye(int width, int height, double fov_deg);

  /// Maps the camera's frame (x right, y down, z forward) to the device's.
  Eigen::Isometry3d T_device_cam() const;

  /// True where nothing moves: every exposure with the same laser sees the same.
  bool is_static() const;

  /// @throws Error{kBadValue} naming the field, the value and what was expected.
  void validate() const;
};

}  // namespace striper
