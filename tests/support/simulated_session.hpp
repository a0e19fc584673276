// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <striper/session/calibrate.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/shared_data.hpp"

namespace striper::testing {

/// The scene of data/scenes/calibration.yaml: a checkerboard carried through the laser plane.
inline Scene calibration_scene() { return load_scene(source_path("data/scenes/calibration.yaml")); }

/// The images of such a scene as a session, board and stripe in each.
inline CalibrationInput simulated_session(const Scene& scene, int images) {
  Simulator simulator(scene);
  CalibrationInput input;
  input.board = parse_board("9x6", 0.06);
  auto& lit = input.lasers.emplace_back().on;
  for (int i = 0; i < images; ++i)
    lit.emplace_back("image " + std::to_string(i),
                     simulator.render(static_cast<std::uint64_t>(i)).image);
  return input;
}

}  // namespace striper::testing
