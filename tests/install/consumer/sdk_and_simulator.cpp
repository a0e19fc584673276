// SPDX-License-Identifier: Apache-2.0
// Scans a simulated wall 2 m away with nothing but the installed headers and libraries.
#include <cmath>
#include <cstdio>
#include <exception>

#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>

constexpr const char* kScene = R"(striper_scene: 1
camera: {width: 160, height: 120, fov_deg: 55, lens: plumb_bob}
lasers:
  - {position_m: [0, 0, -0.5], fan_deg: 60, thickness_deg: 0.4, wavelength_nm: 900, pulse_uj: 10.4}
objects:
  - {name: wall, shape: plane, position_m: [2, 0, 0], reflectance: 0.5}
)";

int main() try {
  striper::Simulator simulator(striper::parse_scene(kScene, "wall"));
  striper::Scanner scanner(simulator.model());
  int near_the_wall = 0;
  scanner.process(simulator.render(0));
  for (const striper::PolarScan& scan : scanner.finish()) {  // One frame: held to its end.
    for (const striper::Return& point : scan.returns) {
      if (std::abs(point.x_m - 2.0) < 0.1) ++near_the_wall;
    }
  }
  std::printf("%d of 160 columns see the wall\n", near_the_wall);
  return near_the_wall > 150 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
