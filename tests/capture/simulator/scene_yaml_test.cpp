// SPDX-License-Identifier: Apache-2.0
// Proves that every key of a scene file arrives where it should and that whatever is wrong is
// refused with file, line, field, value and what was expected. The shipped scenes all load.
#include <filesystem>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/simulator/scene_yaml.hpp>

#include "support/error_of.hpp"
#include "support/shared_data.hpp"

namespace striper {
namespace {

constexpr double kDegree = M_PI / 180.0;

TEST(SceneYaml, EveryShippedSceneLoads) {
  int count = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(testing::source_path("data/scenes"))) {
    if (entry.path().extension() != ".yaml") continue;
    EXPECT_NO_THROW(load_scene(entry.path())) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 5);
}

TEST(SceneYaml, EmptySceneHasTheDefaults) {
  const Scene scene = parse_scene("striper_scene: 1\n", "empty");
  EXPECT_EQ(scene.camera, Scene().camera);
  EXPECT_EQ(scene.lasers.size(), 1U);
  EXPECT_EQ(scene.lasers[0].pulse_energy_j, Scene().lasers[0].pulse_energy_j);
  EXPECT_TRUE(scene.objects.empty());
  EXPECT_EQ(scene.name, "empty");
}

// A scene with every key.
constexpr const char* kEveryKey = R"(
striper_scene: 1
camera: {width: 800, height: 600, focal_px: [700, 701], center_px: [401, 299], lens: equidistant,
         distortion: [0.01, 0.02, 0.03, 0.04], rotation_deg: [1, 2, 3]}
imager: {pixel_pitch_um: 5.5, f_number: 2, lens_transmission: 0.7, falloff_exponent: 3, blur_px: 0.6,
         quantum_efficiency: 0.2, filter: {center_nm: 905, width_nm: 10, transmission: 0.6},
         shutter_us: 20, bits: 12, dn_per_electron: 0.3, black_level_dn: 64, full_well_e: 10000,
         bloom: {fraction: 0.02, sigma_px: 6}, region: [100, 50, 400, 300], binning: [2, 3]}
noise: {shot: no, read_e: 5, prnu: 0.01, speckle: 0.1, seed: 77}
timing: {picture_rate_hz: 25, scan: bottom-first, cadence: "0,1,dark"}
stripe_axis: rows
lasers:
  - {position_m: [0.1, 0.2, 0.3], rotation_deg: [90, 10, 0], fan_deg: 45, thickness_deg: 0.3,
     thickness_mm: 1, focus_m: 2, wavelength_nm: 905, pulse_uj: 20}
  - {power_mw: 50, wavelength_nm: 904}
daylight: {sun_w_m2_nm: 0.8, sun_azimuth_deg: 90, sun_elevation_deg: 30, shadows: off,
           sky_w_m2_nm: 0.1, ambient_w_m2_nm: 0.2, sky_radiance_w_m2_sr_nm: 0.3}
device: {position_m: [1, 2, 3], rotation_deg: [0, 0, 90], velocity_m_s: [4, 5, 6],
         angular_velocity_deg_s: [0, 0, 180]}
edge_distance_px: 7
objects:
  - {name: ground, shape: plane, normal: [0, 0, 1], reflectance: 0.1,
     stripe: {width_m: 0.12, offset_m: 0.5, dash_m: 3, gap_m: 9, reflectance: 0.6, wear: 0.2,
              grain_m: 0.01, retro: {gain: 5, spread_deg: 3}}}
  - {name: board, shape: rectangle, size_m: [0.5, 0.4], position_m: [1, 0, 0],
     checkerboard: {columns: 7, rows: 5, square_m: 0.05, black: 0.1, white: 0.9}}
  - {shape: disc, radius_m: 0.2, radiance_w_m2_sr_nm: 3}
  - {shape: box, size_m: [1, 2, 3], retro: {gain: 10, spread_deg: 2},
     mottle: {contrast: 0.3, grain_m: 0.02}}
  - {shape: cylinder, radius_m: 0.1, length_m: 2, velocity_m_s: [1, 0, 0]}
  - {shape: sweep, profile_m: [[0, 0], [0, 0.15], [1, 0.15]], length_m: 5}
  - {shape: rectangle, size_m: [1, 1],
     wood: {fibre_m: 0.01, length_m: 0.4, direction_deg: 90, dark: 0.1, light: 0.5}}
  - {shape: rectangle, size_m: [1, 1],
     poster: {cell_m: 0.2, darkest: 0.1, lightest: 0.7, seed: 5}}
)";

TEST(SceneYaml, TheCameraArrives) {
  const Scene scene = parse_scene(kEveryKey, "all");
  EXPECT_EQ(scene.camera, CameraModel(800, 600, 700, 701, 401, 299, LensModel::kEquidistant,
                                      {0.01, 0.02, 0.03, 0.04}));
  EXPECT_TRUE(scene.camera_rotation.isApprox(
      rotation_from_rpy(1 * kDegree, 2 * kDegree, 3 * kDegree), 1e-15));
}

TEST(SceneYaml, TheImagerArrives) {
  const Scene scene = parse_scene(kEveryKey, "all");
  const Imager& imager = scene.imager;
  EXPECT_DOUBLE_EQ(imager.pixel_pitch_m, 5.5e-6);
  EXPECT_EQ(imager.f_number, 2.0);
  EXPECT_EQ(imager.lens_transmission, 0.7);
  EXPECT_EQ(imager.falloff_exponent, 3.0);
  EXPECT_EQ(imager.blur_sigma_px, 0.6);
  EXPECT_EQ(imager.quantum_efficiency, 0.2);
  EXPECT_EQ(imager.filter.center_nm, 905.0);
  EXPECT_EQ(imager.filter.width_nm, 10.0);
  EXPECT_EQ(imager.filter.transmission, 0.6);
  EXPECT_DOUBLE_EQ(imager.shutter_s, 20e-6);
  EXPECT_EQ(imager.bit_depth, 12);
  EXPECT_EQ(imager.dn_per_electron, 0.3);
  EXPECT_EQ(imager.black_level_dn, 64.0);
  EXPECT_EQ(imager.full_well_e, 10000.0);
  EXPECT_EQ(imager.bloom.fraction, 0.02);
  EXPECT_EQ(imager.bloom.sigma_px, 6.0);
  EXPECT_EQ(imager.region, cv::Rect(100, 50, 400, 300));
  EXPECT_EQ(imager.binning, cv::Size(2, 3));
}

TEST(SceneYaml, NoiseAndTimingArrive) {
  const Scene scene = parse_scene(kEveryKey, "all");
  const Imager& imager = scene.imager;
  EXPECT_FALSE(imager.noise.shot);
  EXPECT_EQ(imager.noise.read_noise_e, 5.0);
  EXPECT_EQ(imager.noise.prnu, 0.01);
  EXPECT_EQ(imager.noise.speckle, 0.1);
  EXPECT_EQ(scene.seed, 77U);
  EXPECT_EQ(scene.timing.picture_rate_hz, 25.0);
  EXPECT_EQ(scene.timing.scan, ScanMode::kBottomFirst);
  EXPECT_EQ(scene.timing.pattern, IlluminationPattern::parse("0,1,dark"));
  EXPECT_EQ(scene.axis, StripeAxis::kRows);
}

TEST(SceneYaml, LasersArrive) {
  const Scene scene = parse_scene(kEveryKey, "all");
  ASSERT_EQ(scene.lasers.size(), 2U);
  const SimulatedLaser& laser = scene.lasers[0];
  EXPECT_EQ(laser.T_device_laser.translation(), Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_DOUBLE_EQ(laser.fan_rad, 45 * kDegree);
  EXPECT_NEAR(laser.divergence_sigma_rad * std::sqrt(2 * M_PI), 0.3 * kDegree, 1e-15);
  EXPECT_NEAR(laser.waist_sigma_m * std::sqrt(2 * M_PI), 1e-3, 1e-15);
  EXPECT_EQ(laser.focus_m, 2.0);
  EXPECT_EQ(laser.wavelength_nm, 905.0);
  EXPECT_DOUBLE_EQ(laser.pulse_energy_j, 20e-6);
  EXPECT_DOUBLE_EQ(scene.lasers[1].pulse_energy_j, 50e-3 * 20e-6);  // Power times shutter.
}

TEST(SceneYaml, DaylightAndDeviceArrive) {
  const Scene scene = parse_scene(kEveryKey, "all");
  EXPECT_EQ(scene.daylight.sun_w_m2_nm, 0.8);
  EXPECT_TRUE(scene.daylight.sun_direction.isApprox(
      Eigen::Vector3d(0, std::cos(30 * kDegree), std::sin(30 * kDegree)), 1e-12));
  EXPECT_FALSE(scene.daylight.shadows);
  EXPECT_EQ(scene.daylight.sky_w_m2_nm, 0.1);
  EXPECT_EQ(scene.daylight.ambient_w_m2_nm, 0.2);
  EXPECT_EQ(scene.daylight.sky_radiance_w_m2_sr_nm, 0.3);
  EXPECT_EQ(scene.T_world_device.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(scene.device_motion.velocity_m_s, Eigen::Vector3d(4, 5, 6));
  EXPECT_DOUBLE_EQ(scene.device_motion.angular_velocity_rad_s.z(), M_PI);
  EXPECT_EQ(scene.edge_distance_px, 7);
}

TEST(SceneYaml, TexturesArrive) {
  const Scene scene = parse_scene(kEveryKey, "all");
  ASSERT_EQ(scene.objects.size(), 8U);
  const auto& stripe = std::get<PaintedStripe>(scene.objects[0].material.texture);
  EXPECT_EQ(stripe.gap_m, 9.0);
  EXPECT_EQ(stripe.wear, 0.2);
  EXPECT_EQ(stripe.retro_gain, 5.0);
  EXPECT_DOUBLE_EQ(stripe.retro_spread_rad, 3 * kDegree);
  const auto& wood = std::get<WoodGrain>(scene.objects[6].material.texture);
  EXPECT_EQ(wood.fibre_m, 0.01);
  EXPECT_EQ(wood.length_m, 0.4);
  EXPECT_DOUBLE_EQ(wood.direction_rad, 90 * kDegree);
  EXPECT_EQ(wood.dark, 0.1);
  EXPECT_EQ(wood.light, 0.5);
  const auto& poster = std::get<Poster>(scene.objects[7].material.texture);
  EXPECT_EQ(poster.cell_m, 0.2);
  EXPECT_EQ(poster.darkest, 0.1);
  EXPECT_EQ(poster.lightest, 0.7);
  EXPECT_EQ(poster.seed, 5);
  EXPECT_TRUE((scene.objects[0].T_world_object.linear() * -Eigen::Vector3d::UnitX())
                  .isApprox(Eigen::Vector3d::UnitZ(), 1e-15));
  const auto& board = std::get<Checkerboard>(scene.objects[1].material.texture);
  EXPECT_EQ(board.columns, 7);
  EXPECT_EQ(board.border_m, 0.05);  // By default as wide as a square.
}

TEST(SceneYaml, ShapesArrive) {
  const Scene scene = parse_scene(kEveryKey, "all");
  EXPECT_EQ(std::get<Rectangle>(scene.objects[1].shape).height_m, 0.4);
  EXPECT_EQ(std::get<Disc>(scene.objects[2].shape).radius_m, 0.2);
  EXPECT_EQ(scene.objects[2].material.radiance_w_m2_sr_nm, 3.0);
  EXPECT_EQ(std::get<Box>(scene.objects[3].shape).size_m, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(scene.objects[3].material.retro_gain, 10.0);
  EXPECT_EQ(scene.objects[3].material.mottle_contrast, 0.3);
  EXPECT_EQ(scene.objects[3].material.mottle_grain_m, 0.02);
  EXPECT_EQ(std::get<Cylinder>(scene.objects[4].shape).length_m, 2.0);
  EXPECT_EQ(std::get<Sweep>(scene.objects[5].shape).profile_m.size(), 3U);
}

struct Malformed {
  const char* yaml;
  const char* message;
};

constexpr Malformed kMalformed[] = {
    {"", "x: the file: empty - expected a map with striper_scene, camera"},
    {"camera: {}\n", "x:1: striper_scene is missing - expected 1, the version of the format"},
    {"striper_scene: 2\n",
     "x:1: striper_scene: '2' - expected 1: the version of the format that this program reads"},
    {"striper_scene: 1\nobject: []\n",
     "x:2: the file: the key 'object' - expected striper_scene, camera"},
    {"striper_scene: 1\nstriper_scene: 1\n",
     "x:2: the file: key 'striper_scene' a second time - expected each key once"},
    {"striper_scene: 1\ncamera: {fov_deg: wide}\n",
     "x:2: camera.fov_deg: 'wide' - expected a finite number"},
    {"striper_scene: 1\ncamera: {fov_deg: .nan}\n",
     "x:2: camera.fov_deg: '.nan' - expected a finite number"},
    {"striper_scene: 1\ncamera: {fov_deg: 200}\n",
     "x:2: camera: field of view 200 degrees - expected more than 0 and less than 180"},
    {"striper_scene: 1\ncamera: {focal_px: [-1, 1]}\n",
     "x:2: camera: focal length fx is -1 - expected a finite number above 0"},
    {"striper_scene: 1\ncamera: {lens: fisheye}\n",
     "x:2: camera.lens: 'fisheye' - expected plumb_bob, rational_polynomial or equidistant"},
    {"striper_scene: 1\ncamera: {distortion: [1, 2]}\n",
     "x:2: camera.distortion: a list of 2 - expected 5 numbers"},
    {"striper_scene: 1\nimager: {bits: 7}\n",
     "x:2: imager.bits: 7 - expected a number from 8 to 16"},
    {"striper_scene: 1\nimager: {bits: 8.5}\n",
     "x:2: imager.bits: '8.5' - expected a whole number"},
    {"striper_scene: 1\nimager: {region: [600, 0, 100, 100]}\n",
     "x:2: imager.region: [600, 0, 100, 100] - expected a part of the sensor, which is 640x480"},
    {"striper_scene: 1\nimager: {binning: [3, 1]}\n",
     "x:2: imager.binning: [3, 1] - expected divisors of the image's size, 640x480"},
    {"striper_scene: 1\nnoise: {shot: perhaps}\n",
     "x:2: noise.shot: 'perhaps' - expected yes or no"},
    {"striper_scene: 1\nnoise: {read_e: -1}\n",
     "x:2: noise.read_e: -1 - expected a number, 0 or above"},
    {"striper_scene: 1\ntiming: {scan: sideways}\n",
     "x:2: timing.scan: 'sideways' - expected progressive, top-first, bottom-first, "
     "alternate-top-first, alternate-bottom-first"},
    {"striper_scene: 1\ntiming: {cadence: '0,2'}\n",
     "x:2: timing.cadence: '0,2' - expected laser indices below 1, the number of lasers"},
    {"striper_scene: 1\ntiming: {cadence: auto}\n",
     "x:2: timing.cadence: 'auto' - expected what the lasers do, such as '0' or '0,dark'"},
    {"striper_scene: 1\nlasers:\n  - {wavelength_nm: 650}\n",
     "x:3: lasers[0].wavelength_nm: 650 - expected a wavelength that the filter lets pass, 887.5 "
     "to 912.5"},
    {"striper_scene: 1\nlasers:\n  - {fan_deg: 200}\n",
     "x:3: lasers[0].fan_deg: 200 - expected less than a half turn, 180"},
    {"striper_scene: 1\nlasers:\n  - {thickness_deg: 0}\n",
     "x:3: lasers[0].thickness_deg: 0 - expected more than 0, or a thickness_mm that is"},
    {"striper_scene: 1\nlasers:\n  - {pulse_uj: 1, power_mw: 2}\n",
     "x:3: lasers[0].power_mw: '2' - expected either pulse_uj or power_mw, not both"},
    {"striper_scene: 1\nobjects: {}\n", "x:2: objects: a map of 0 - expected a list of objects"},
    {"striper_scene: 1\nobjects:\n  - {size_m: [1, 1]}\n",
     "x:3: objects[0].shape is missing - expected plane, rectangle, disc, box, cylinder or sweep"},
    {"striper_scene: 1\nobjects:\n  - {shape: ball}\n",
     "x:3: objects[0].shape: 'ball' - expected plane, rectangle, disc, box, cylinder or sweep"},
    {"striper_scene: 1\nobjects:\n  - {shape: box, size_m: [1, 2]}\n",
     "x:3: objects[0].size_m: a list of 2 - expected [along x, y, z]"},
    {"striper_scene: 1\nobjects:\n  - {shape: box, size_m: [1, 2, 0]}\n",
     "x:3: objects[0].size_m: 0 - expected a number above 0"},
    {"striper_scene: 1\nobjects:\n  - {shape: plane, wood: {}, poster: {}}\n",
     "x:3: objects[0].poster: a map of 0 - expected one texture: either checkerboard or stripe, "
     "wood or poster"},
    {"striper_scene: 1\nobjects:\n  - {shape: plane, wood: {fibre_m: 0}}\n",
     "objects[0].wood.fibre_m: 0 - expected a number above 0"},
    {"striper_scene: 1\nobjects:\n  - {shape: plane, poster: {darkest: 2}}\n",
     "objects[0].poster.darkest: 2 - expected a number from 0 to 1"},
    {"striper_scene: 1\nobjects:\n  - {shape: plane, reflectance: 1.5}\n",
     "x:3: objects[0].reflectance: 1.5 - expected a number from 0 to 1"},
    {"striper_scene: 1\nobjects:\n  - {shape: plane, normal: [0, 0, 0]}\n",
     "objects[0].normal: [0, 0, 0] - expected a direction [x, y, z] that is not zero"},
    {"striper_scene: 1\nobjects:\n  - {shape: sweep, profile_m: [[0, 0]]}\n",
     "x:3: objects[0].profile_m: 1 - expected at least two points"},
    {"striper_scene: 1\nobjects:\n  - shape: sweep\n    profile_m: [[0, 0], [0, 0]]\n",
     "x:4: objects[0].profile_m: points 0 and 1, 0 m apart - expected points that are apart"},
    {"striper_scene: 1\nimager:\n  f_number: 2\n  shutter_us: 1e30\n",
     "x:4: imager.shutter_us: 1e+30 - expected a number from 1e-06 to 1"},
    {"striper_scene: 1\nlasers:\n  - thickness_mm: -2\n    fan_deg: 50\n",
     "x:3: lasers[0].thickness_mm: -2 - expected a number, 0 or above"},
    {"striper_scene: 1\nlasers: []\n", "x:2: lasers: [] - expected one laser at least"},
    {"striper_scene: 1\nlasers:\n  - {}\n  - power_mw: -7\n",
     "x:4: lasers[1].power_mw: '-7' - expected a number from 0 to 1e9"},
    {"striper_scene: 1\nobjects:\n  - {shape: plane}\n  - shape: plane\n    retro: {gain: 1,\n     "
     "       spread_deg: -3}\n",
     "x:6: objects[1].retro.spread_deg: -3 - expected a number above 0"},
    {"striper_scene: 1\ncamera: {width: 640\n", "x:3: not valid YAML: "},
    {"striper_scene: 1\ncamera: {width: 20000, height: 20000}\n",
     "x:2: camera: 20000x20000 pixels - expected at most 50 million in all"},
    {"striper_scene: 1\nimager: {region: [0, 0, 1e300, 5]}\n",
     "imager.region[2]: '1e300' - expected a whole number from -1000000 to 1000000"},
    {"striper_scene: 1\nimager: {region: [0, 0, 5]}\n",
     "imager.region: a list of 3 - expected four whole numbers [left, top, width, height]"},
    {"a: &a [1]\nb: [*a, *a]\n", "x:2: an alias (*name) - expected every value written out"},
    {"striper_scene: 1\ncamera: {fov_degg: 55}\n",
     "x:2: camera: the key 'fov_degg' - expected width, height, fov_deg, focal_px, center_px, "
     "lens, "
     "distortion, rotation_deg; did you mean 'fov_deg'?"},
    {"striper_scene: 1\nimager: {region: [0.5, 0, 100, 50]}\n",
     "imager.region[0]: '0.5' - expected a whole number"},
    {"striper_scene: 1\nimager: {binning: [2, 1.5]}\n",
     "imager.binning[1]: '1.5' - expected a whole number"},
};

TEST(SceneYaml, WhatIsWrongIsRefusedWithItsPlace) {
  for (const Malformed& malformed : kMalformed) {
    SCOPED_TRACE(malformed.yaml);
    const Error error = testing::error_of([&] { parse_scene(malformed.yaml, "x"); });
    EXPECT_EQ(error.kind(), ErrorKind::kBadFile);
    EXPECT_NE(std::string(error.what()).find(malformed.message), std::string::npos)
        << "said: " << error.what() << "\nnot:  " << malformed.message;
  }
}

TEST(SceneYaml, MissingFileIsNotFound) {
  const Error error = testing::error_of([&] { load_scene("no/such.yaml"); });
  EXPECT_EQ(error.kind(), ErrorKind::kNotFound);
}

}  // namespace
}  // namespace striper
