// SPDX-License-Identifier: Apache-2.0
#include "support/random_scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include <striper/simulator/radiometry.hpp>

namespace striper::testing {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kGrey = 0.4;         // The reflectance that brightness is set for,
constexpr double kGreyRange_m = 2.0;  // and its distance.

Eigen::Isometry3d pose(const Eigen::Vector3d& position, const Eigen::Matrix3d& rotation) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = position;
  T.linear() = rotation;
  return T;
}

Eigen::Isometry3d turned(const Eigen::Vector3d& position, double yaw_deg, double pitch_deg = 0.0,
                         double roll_deg = 0.0) {
  return pose(position,
              rotation_from_rpy(kDegree * roll_deg, kDegree * pitch_deg, kDegree * yaw_deg));
}

double stripe_sigma_px(const Scene& scene, double range_m) {
  const double laser_px =
      thickness_sigma_m(scene.lasers.front(), range_m) * scene.camera.fy() / range_m;
  return std::hypot(laser_px, scene.imager.blur_sigma_px);
}

double dn_per_ambient(const Scene& scene) {
  const Imager& imager = scene.imager;
  return imager.dn_per_electron * electrons_per_radiance(imager, imager.filter.center_nm) *
         imager.filter.width_nm * imager.shutter_s * kGrey / std::numbers::pi;
}

void draw_sensor(Imager& imager, SceneDice& dice) {
  imager.blur_sigma_px = dice.between(0.3, 0.9);
  imager.noise.read_noise_e = dice.between(5.0, 25.0);
  imager.noise.prnu = dice.chance(0.5) ? dice.between(0.0, 0.01) : 0.0;
  imager.dn_per_electron = dice.ratio(0.02, 0.08);
  imager.falloff_exponent = dice.chance(0.5) ? dice.between(0.0, 4.0) : 0.0;
  if (dice.chance(0.3)) imager.bloom = {dice.between(0.0, 0.02), dice.between(5.0, 15.0)};
  if (dice.chance(0.25)) {  // The same light on a finer scale.
    imager.bit_depth = 12;
    imager.dn_per_electron *= 16.0;
    imager.black_level_dn *= 16.0;
  }
}

// Lens, sensor and exposure; brightness is set once the laser stands.
void draw_camera(Scene& scene, SceneDice& dice) {
  const bool is_large = dice.chance(0.15);
  const double fov_deg = dice.between(55.0, 105.0);
  const int width = is_large ? 1280 : 640;
  const int height = is_large ? 720 : 480;
  const bool is_fisheye = fov_deg > 90.0 || dice.chance(0.2);
  const CameraModel plain = Scene::pinhole(width, height, fov_deg);
  const double k1 = dice.between(-0.15, 0.02);
  scene.camera = is_fisheye ? Scene::fisheye(width, height, fov_deg)
                            : CameraModel(width, height, plain.fx(), plain.fy(), plain.cx(),
                                          plain.cy(), LensModel::kPlumbBob,
                                          {fov_deg < 80.0 ? k1 : 0.0, 0.0, 0.0, 0.0, 0.0});
  draw_sensor(scene.imager, dice);
}

// The laser below or above the camera, which looks at where the laser plane is 0.9 to 2.5 m away.
double draw_laser(Scene& scene, SceneDice& dice) {
  const double baseline_m = dice.between(0.15, 0.6);
  const double side = dice.chance(0.7) ? -1.0 : 1.0;
  const double sheet_pitch_deg = dice.chance(0.3) ? dice.between(-4.0, 4.0) : 0.0;
  SimulatedLaser& laser = scene.lasers.front();
  laser.T_device_laser = turned({0.0, 0.0, side * baseline_m}, 0.0, sheet_pitch_deg,
                                dice.chance(0.3) ? dice.between(-3.0, 3.0) : 0.0);
  laser.fan_rad = kDegree * dice.between(60.0, 120.0);
  laser.divergence_sigma_rad = SimulatedLaser::thickness_to_sigma(kDegree * dice.ratio(0.15, 1.0));
  const double seen_deg = -side * std::atan(baseline_m / dice.between(0.9, 2.5)) / kDegree;
  scene.camera_rotation = rotation_from_rpy(0.0, kDegree * (seen_deg + 0.5 * sheet_pitch_deg), 0.0);
  const double height_m = dice.between(0.35, 0.9) + (side < 0.0 ? baseline_m : 0.0);
  scene.T_world_device = turned({0.0, 0.0, height_m}, 0.0);
  return height_m + side * baseline_m;
}

void set_light(Scene& scene, SceneDice& dice, double range_m, double brightest_dn) {
  const double scale = scene.imager.bit_depth > 8 ? 16.0 : 1.0;
  SimulatedLaser& laser = scene.lasers.front();
  laser.pulse_energy_j = 1e-6;
  laser.pulse_energy_j *=
      scale * dice.ratio(40.0, 250.0) / stripe_amplitude_dn(scene, kGrey, range_m);
  const double background = scale * dice.ratio(25.0, brightest_dn) / dn_per_ambient(scene);
  const double sky_share = dice.between(0.0, 0.6);
  scene.daylight.ambient_w_m2_nm = (1.0 - sky_share) * background;
  scene.daylight.sky_w_m2_nm = 2.0 * sky_share * background;
}

Poster draw_poster(SceneDice& dice) {
  return {dice.ratio(0.04, 0.3), dice.between(0.03, 0.2), dice.between(0.5, 0.9),
          dice.whole(1, 100000)};
}

// Paint, paper, wood and grass: what flat faces are covered with.
void draw_texture(Material& material, SceneDice& dice) {
  material.reflectance = dice.ratio(0.08, 0.85);
  const double kind = dice.between(0.0, 1.0);
  if (kind < 0.25) {
    material.mottle_contrast = dice.between(0.1, 0.7);
    material.mottle_grain_m = dice.ratio(0.01, 0.15);
  } else if (kind < 0.45) {
    material.texture =
        WoodGrain{dice.ratio(0.004, 0.03), dice.ratio(0.1, 1.0),
                  kDegree * (dice.chance(0.5) ? 0.0 : 90.0) + dice.between(-0.05, 0.05),
                  dice.between(0.08, 0.25), dice.between(0.3, 0.7)};
  } else if (kind < 0.6) {
    material.texture = draw_poster(dice);
  } else if (kind < 0.7) {
    material.texture = PaintedStripe{dice.ratio(0.01, 0.12), dice.between(-0.1, 0.1),
                                     dice.chance(0.5) ? dice.between(0.02, 0.2) : 0.0,
                                     dice.between(0.02, 0.2), dice.between(0.05, 0.9)};
  }
}

SceneObject checker(SceneDice& dice) {
  Checkerboard board;
  board.columns = dice.whole(4, 12);
  board.rows = dice.whole(4, 9);
  board.square_m = dice.ratio(0.02, 0.1);
  board.border_m = dice.between(0.3, 1.0) * board.square_m;
  SceneObject object;
  object.name = "checker";
  object.shape = Rectangle{(board.columns + 1) * board.square_m + 2.0 * board.border_m,
                           (board.rows + 1) * board.square_m + 2.0 * board.border_m};
  object.material.reflectance = 0.85;
  object.material.texture = board;
  return object;
}

SceneObject furniture(SceneDice& dice, double sheet_m) {
  SceneObject object;
  const double kind = dice.between(0.0, 1.0);
  const double top_m = sheet_m * 2.0 * dice.between(0.35, 1.5);
  if (kind < 0.45) {
    object.name = "box";
    object.shape = Box{{dice.between(0.08, 0.5), dice.between(0.08, 0.5), top_m}};
  } else if (kind < 0.65) {
    object.name = "cylinder";
    object.shape = Cylinder{dice.between(0.05, 0.2), top_m};
  } else if (kind < 0.8) {
    object.name = "post";
    object.shape = Cylinder{dice.between(0.01, 0.05), 2.4};
  } else {
    object = checker(dice);
    return object;
  }
  draw_texture(object.material, dice);
  if (dice.chance(0.15)) object.material.reflectance = 0.03;
  if (dice.chance(0.08)) object.material.retro_gain = dice.ratio(1.0, 20.0);
  return object;
}

double standing_height_m(const SceneObject& object) {
  if (const auto* box = std::get_if<Box>(&object.shape)) return 0.5 * box->size_m.z();
  if (const auto* tube = std::get_if<Cylinder>(&object.shape)) return 0.5 * tube->length_m;
  return 0.0;
}

void add_furniture(Scene& scene, SceneDice& dice, double sheet_m, double wall_m) {
  const int count = dice.whole(4, 11);
  for (int i = 0; i < count; ++i) {
    SceneObject object = furniture(dice, sheet_m);
    const double x = dice.between(0.8, wall_m - 0.3);
    const double y = dice.between(-0.9, 0.9) * x;
    const bool is_board = object.name == "checker";
    const double z = is_board ? sheet_m + dice.between(-0.15, 0.15) : standing_height_m(object);
    object.T_world_object = is_board ? turned({x, y, z}, dice.between(-50.0, 50.0),
                                              dice.between(-40.0, 40.0), dice.between(-20.0, 20.0))
                                     : turned({x, y, z}, dice.between(-90.0, 90.0));
    scene.objects.push_back(std::move(object));
  }
}

void add_wall(Scene& scene, SceneDice& dice, const char* name, const Eigen::Vector3d& position,
              const Eigen::Vector3d& normal) {
  SceneObject wall;
  wall.name = name;
  wall.T_world_object = pose(position, facing(normal));
  draw_texture(wall.material, dice);
  if (dice.chance(0.6)) wall.material.texture = {};  // Bare walls are the commoner ones.
  scene.objects.push_back(std::move(wall));
}

void add_walls(Scene& scene, SceneDice& dice, double wall_m) {
  add_wall(scene, dice, "floor", Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ());
  add_wall(scene, dice, "ceiling", {0.0, 0.0, 2.6}, -Eigen::Vector3d::UnitZ());
  add_wall(scene, dice, "far wall", {wall_m, 0.0, 0.0},
           Eigen::Vector3d(-1.0, dice.between(-0.4, 0.4), 0.0).normalized());
  add_wall(scene, dice, "left wall", {0.0, dice.between(1.2, 3.0), 0.0}, -Eigen::Vector3d::UnitY());
  add_wall(scene, dice, "right wall", {0.0, -dice.between(1.2, 3.0), 0.0},
           Eigen::Vector3d::UnitY());
}

// Papers just before the far wall, light sources and specular highlights anywhere.
void add_decoration(Scene& scene, SceneDice& dice, double sheet_m, double wall_m) {
  const Eigen::Matrix3d on_wall = scene.objects[2].T_world_object.linear();
  for (int i = dice.whole(0, 3); i > 0; --i) {
    SceneObject paper = checker(dice);
    paper.name = "poster";
    if (dice.chance(0.6)) {
      paper.material.texture = draw_poster(dice);
      paper.shape = Rectangle{dice.between(0.2, 1.0), dice.between(0.2, 1.0)};
    }
    const double y = dice.between(-1.2, 1.2);
    const Eigen::Vector3d along = on_wall.col(1) / on_wall.col(1).y();
    paper.T_world_object = pose(Eigen::Vector3d(wall_m, 0.0, sheet_m + dice.between(-0.6, 0.6)) +
                                    y * along - 0.003 * on_wall.col(0),
                                on_wall);
    scene.objects.push_back(std::move(paper));
  }
  for (int i = dice.whole(0, 4); i > 0; --i) {
    SceneObject light_source;
    light_source.name = "light source";
    light_source.shape = Disc{dice.ratio(0.004, 0.06)};
    light_source.material.radiance_w_m2_sr_nm =
        dice.ratio(0.3, 30.0) * scene.daylight.ambient_w_m2_nm / std::numbers::pi;
    const double x = dice.between(0.7, wall_m - 0.1);
    light_source.T_world_object =
        turned({x, dice.between(-0.7, 0.7) * x, sheet_m + dice.between(-0.5, 0.7)}, 0.0);
    scene.objects.push_back(std::move(light_source));
  }
}

// The boards of which sessions are made: inner corners and squares.
constexpr struct {
  int columns;
  int rows;
  double square_m;
} kBoards[] = {{9, 6, 0.06}, {8, 6, 0.04}, {7, 5, 0.05}, {11, 8, 0.03}};
constexpr double kUsualBoard_m = 0.72;  // What data/scenes/calibration.yaml carries about.

// A board that leans towards the camera with every side in turn while it goes away, its middle
// near the laser plane. `size` is the session's over the usual one.
SceneObject carried_board(SceneDice& dice, double baseline_m, double& size) {
  const auto& kind = kBoards[dice.whole(0, 3)];
  Checkerboard board{kind.columns, kind.rows, kind.square_m, kind.square_m};
  SceneObject object;
  object.name = "board";
  const double width_m = (board.columns + 3) * board.square_m;
  object.shape = Rectangle{width_m, (board.rows + 3) * board.square_m};
  object.material.reflectance = 0.85;
  object.material.texture = board;
  size = width_m / kUsualBoard_m;
  object.T_world_object = turned({size * dice.between(1.0, 1.2), size * dice.between(-0.2, 0.0),
                                  -baseline_m + size * dice.between(-0.05, 0.15)},
                                 0.0, dice.between(20.0, 40.0));
  object.motion.velocity_m_s =
      size * Eigen::Vector3d(dice.between(0.04, 0.08), dice.between(0.0, 0.04),
                             dice.between(-0.01, 0.005));
  object.motion.angular_velocity_rad_s = {kDegree * dice.between(50.0, 80.0), 0.0, 0.0};
  return object;
}

}  // namespace

double SceneDice::ratio(double low, double high) {
  return low * std::pow(high / low, between(0.0, 1.0));
}

int SceneDice::whole(int low, int high) {
  return std::min(high, low + static_cast<int>(between(0.0, high - low + 1.0)));
}

Scene random_room(std::uint64_t seed) {
  SceneDice dice(seed);
  Scene scene;
  scene.name = "room " + std::to_string(seed);
  scene.seed = seed;
  draw_camera(scene, dice);
  const double sheet_m = draw_laser(scene, dice);
  set_light(scene, dice, kGreyRange_m, 130.0);
  const double wall_m = dice.between(2.2, 5.0);
  add_walls(scene, dice, wall_m);
  add_furniture(scene, dice, sheet_m, wall_m);
  add_decoration(scene, dice, sheet_m, wall_m);
  scene.validate();
  return scene;
}

Scene random_bare_room(std::uint64_t seed) {
  SceneDice dice(seed + 0xBA5E);
  Scene scene = random_room(seed);
  std::erase_if(scene.objects, [](const SceneObject& object) {
    return object.material.radiance_w_m2_sr_nm > 0.0;
  });
  for (SceneObject& object : scene.objects) {
    object.material.texture = {};
    object.material.mottle_contrast = 0.0;
  }
  scene.lasers.front().pulse_energy_j *= dice.ratio(0.05, 0.5);
  scene.validate();
  return scene;
}

Scene random_session(std::uint64_t seed) {
  SceneDice dice(seed + 0x5E55);
  Scene scene;
  scene.name = "session " + std::to_string(seed);
  scene.seed = seed;
  scene.timing.picture_rate_hz = 1.0;
  double size = 1.0;
  double baseline_m = dice.between(0.3, 0.55);
  SceneObject board = carried_board(dice, 0.0, size);
  baseline_m *= size;
  board.T_world_object.translation().z() -= baseline_m;
  const bool is_large = dice.chance(0.5);
  const CameraModel plain =
      Scene::pinhole(is_large ? 640 : 480, is_large ? 480 : 360, dice.between(45.0, 65.0));
  scene.camera = CameraModel(plain.width(), plain.height(), plain.fx(), plain.fy(), plain.cx(),
                             plain.cy(), LensModel::kPlumbBob,
                             {dice.between(-0.25, 0.05), dice.between(0.0, 0.08), 0.0, 0.0, 0.0});
  const double seen_deg = std::atan(baseline_m / (1.5 * size)) / kDegree - dice.between(2.0, 6.0);
  scene.camera_rotation = rotation_from_rpy(0.0, kDegree * seen_deg, 0.0);
  draw_sensor(scene.imager, dice);
  SimulatedLaser& laser = scene.lasers.front();
  laser.T_device_laser = turned({0.0, 0.0, -baseline_m}, 0.0);
  laser.divergence_sigma_rad = SimulatedLaser::thickness_to_sigma(kDegree * dice.ratio(0.15, 1.0));
  set_light(scene, dice, 1.5 * size, 80.0);  // White paper does not clip.
  scene.objects.push_back(std::move(board));
  scene.validate();
  return scene;
}

Scene without_laser(Scene scene) {
  for (SimulatedLaser& laser : scene.lasers) laser.pulse_energy_j = 0.0;
  return scene;
}

Scene overexposed(Scene scene) {
  SceneDice dice(scene.seed + 0x0BE5);
  scene.imager.dn_per_electron *= dice.ratio(1.3, 4.0);
  return scene;
}

double stripe_amplitude_dn(const Scene& scene, double reflectance, double range_m) {
  const SimulatedLaser& laser = scene.lasers.front();
  const double laser_px = thickness_sigma_m(laser, range_m) * scene.camera.fy() / range_m;
  return scene.imager.dn_per_electron * electrons_per_radiance(scene.imager, laser.wavelength_nm) *
         reflectance / std::numbers::pi * peak_fluence_j_m2(laser, range_m) * laser_px /
         stripe_sigma_px(scene, range_m);
}

StripeLook look_of(const Scene& scene) {
  constexpr double kWhitePaper = 0.85;
  StripeLook look;
  constexpr int kRanges = 9;  // 0.4 to 6.4 m.
  for (int i = 0; i < kRanges; ++i) {
    const double range_m = 0.4 * std::pow(2.0, 0.5 * i);
    look.width_at.push_back({range_m, stripe_sigma_px(scene, range_m)});
    look.amplitude_at.push_back({range_m, stripe_amplitude_dn(scene, kWhitePaper, range_m)});
  }
  look.width_px = stripe_sigma_px(scene, kGreyRange_m);
  return look;
}

}  // namespace striper::testing
