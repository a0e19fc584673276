#pragma once
#include <random>

#include <striper/simulator/scene.hpp>
#include <striper/simulator/scene_yaml.hpp>
inline striper::Scene quick_room(int seed) {
  using namespace striper;
  std::mt19937 g(seed * 7919 + 13);
  auto u = [&](double a, double b) { return a + (b - a) * (g() / 4294967296.0); };
  auto pick = [&](int n) { return static_cast<int>(g() % n); };
  Scene s;
  const double fov = u(50, 105);
  s.camera =
      pick(2) ? Scene::pinhole(640, 480, std::min(fov, 75.0)) : Scene::fisheye(640, 480, fov);
  const double height = u(.5, 1.3), base = u(.15, .6), pitch = u(0, 18) * M_PI / 180;
  s.camera_rotation = rotation_from_rpy(0, pitch, 0);
  s.T_world_device = Eigen::Translation3d(0, 0, height);
  SimulatedLaser l;
  l.T_device_laser = Eigen::Isometry3d(Eigen::Translation3d(0, 0, -std::min(base, height - .05)));
  l.fan_rad = 110 * M_PI / 180;
  l.divergence_sigma_rad = SimulatedLaser::thickness_to_sigma(u(.15, 1.0) * M_PI / 180);
  l.pulse_energy_j = std::exp(u(std::log(2e-6), std::log(4e-5)));
  s.lasers = {l};
  s.imager.blur_sigma_px = u(.3, .8);
  s.imager.dn_per_electron = u(.02, .06);
  s.imager.black_level_dn = 8;

  if (pick(4) == 0) {
    s.imager.bit_depth = 12;
    s.imager.dn_per_electron *= 16;
    s.imager.black_level_dn *= 16;
  }
  s.seed = seed;
  s.daylight.ambient_w_m2_nm = std::exp(u(std::log(.3), std::log(14)));
  s.daylight.sky_w_m2_nm = u(0, 2);
  auto tex = [&](Material& m) {
    m.reflectance = u(.1, .85);
    const int k = pick(5);
    if (k == 1) {
      m.mottle_contrast = u(.2, .8);
      m.mottle_grain_m = std::exp(u(std::log(.01), std::log(.2)));
    }
    if (k == 2) m.reflectance = .03;
  };
  auto add = [&](const char* name, Shape sh, Eigen::Vector3d p, Eigen::Matrix3d R) -> SceneObject& {
    SceneObject o;
    o.name = name;
    o.shape = sh;
    tex(o.material);
    o.T_world_object = Eigen::Isometry3d::Identity();
    o.T_world_object.translate(p);
    o.T_world_object.rotate(R);
    s.objects.push_back(o);
    return s.objects.back();
  };
  const double far = u(1.8, 4.5);
  add("floor", Plane{}, {0, 0, 0}, facing({0, 0, 1}));
  add("far", Plane{}, {far, 0, 0}, facing({-1, 0, 0})).material.reflectance = u(.3, .85);
  add("left", Plane{}, {0, u(1.2, 3), 0}, facing({0, -1, 0})).material.reflectance = u(.2, .85);
  add("right", Plane{}, {0, -u(1.2, 3), 0}, facing({0, 1, 0})).material.reflectance = u(.2, .85);
  const int boxes = 2 + pick(7);
  for (int i = 0; i < boxes; ++i) {
    const double x = u(.6, far - .2), y = u(-.7, .7) * x;
    if (pick(3) == 0)
      add("post", Cylinder{u(.02, .2), 2.0}, {x, y, .9}, Eigen::Matrix3d::Identity());
    else
      add("box", Box{Eigen::Vector3d(u(.1, .5), u(.1, .5), u(.2, 1.8))}, {x, y, u(.1, .9)},
          rotation_from_rpy(0, 0, u(-.8, .8)));
  }
  const int posters = 1 + pick(5);
  for (int i = 0; i < posters; ++i) {
    const double x = pick(2) ? far - .01 : u(.8, far - .1), y = u(-.6, .6) * x, z = u(.1, 1.6);
    auto& o = add("poster", Rectangle{u(.2, .9), u(.2, .9)}, {x, y, z},
                  x > far - .05 ? facing({-1, 0, 0}) : facing({-1, u(-.5, .5), u(-.3, .3)}));
    const int k = pick(3);
    if (k == 0)
      o.material.texture = Checkerboard{3 + pick(8), 3 + pick(6), u(.02, .08), u(0, .06), .05, .85};
    if (k == 1) {
      PaintedStripe p;
      p.width_m = u(.01, .1);
      p.offset_m = u(-.2, .2);
      p.reflectance = u(.5, .9);
      p.wear = u(0, .6);
      p.grain_m = u(.004, .02);
      o.material.texture = p;
      o.material.reflectance = u(.05, .3);
      if (pick(2))
        o.T_world_object.rotate(Eigen::AngleAxisd(M_PI / 2 + u(-.3, .3), Eigen::Vector3d::UnitX()));
    }
  }
  const int lamps = pick(4);
  for (int i = 0; i < lamps; ++i) {
    const double x = u(.8, far - .05), y = u(-.6, .6) * x;
    auto& o = pick(2) ? add("lamp", Disc{u(.004, .06)}, {x, y, u(.1, 2)}, facing({-1, 0, 0}))
                      : add("tube", Rectangle{u(.1, .8), u(.005, .03)}, {x, y, u(.1, 2)},
                            facing({-1, 0, 0}));
    o.material.radiance_w_m2_sr_nm = std::exp(u(std::log(.3), std::log(30)));
  }
  s.name = "room";
  return s;
}
inline striper::Scene quick_session(int seed) {
  using namespace striper;
  std::mt19937 g(seed * 104729 + 7);
  auto u = [&](double a, double b) { return a + (b - a) * (g() / 4294967296.0); };
  auto pick = [&](int n) { return static_cast<int>(g() % n); };
  Scene s = load_scene("/work/main/data/scenes/calibration.yaml");
  s.seed = seed;
  const double f = u(.85, 1.2);
  if (pick(2)) s.camera = Scene::pinhole(640, 480, 60 * f);
  s.lasers[0].divergence_sigma_rad = SimulatedLaser::thickness_to_sigma(u(.15, 1.0) * M_PI / 180);
  s.lasers[0].pulse_energy_j *= u(.4, 2.5);
  s.daylight.ambient_w_m2_nm = u(1, 12);
  if (pick(3) == 0) {
    s.imager.bit_depth = 12;
    s.imager.dn_per_electron *= 16;
    s.imager.black_level_dn *= 16;
  }
  const Checkerboard boards[] = {{9, 6, .06, .06, .05, .85},
                                 {8, 6, .04, .04, .05, .85},
                                 {7, 5, .05, .05, .05, .85},
                                 {11, 8, .03, .04, .05, .85}};
  auto b = boards[pick(4)];
  auto& o = s.objects[0];
  o.material.texture = b;
  o.shape = Rectangle{(b.columns + 1) * b.square_m + 2 * b.border_m,
                      (b.rows + 1) * b.square_m + 2 * b.border_m};
  o.motion.angular_velocity_rad_s *= u(.6, 1.4);
  return s;
}
