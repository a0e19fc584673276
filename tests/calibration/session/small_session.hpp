// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <striper/session/calibrate.hpp>

#include "support/board_picture.hpp"
#include "support/striper_session.hpp"

namespace striper::testing {

/// A small camera, so that a session is rendered and calibrated in a second.
inline SyntheticStriper small_striper(Board::Pattern pattern = Board::Pattern::kCheckerboard) {
  SyntheticStriper striper;
  striper.camera = CameraModel(400, 300, 380.0, 380.0, 201.0, 148.0, LensModel::kPlumbBob,
                               {-0.2, 0.06, 0.0, 0.0, 0.0});
  striper.board = {pattern, 7, 6, 0.06};
  return striper;
}

/// Eight poses, leaning towards the camera with every side in turn, from 0.95 to 1.37 m.
inline std::vector<Eigen::Isometry3d> session_poses(const SyntheticStriper& striper) {
  constexpr int kPoses = 8;
  std::vector<Eigen::Isometry3d> result;
  for (int i = 0; i < kPoses; ++i) {
    const double turn = 2.0 * std::numbers::pi * i / kPoses;
    result.push_back(T_cam_board(
        striper, {200.0 + 35.0 * std::sin(2.0 * turn), 165.0 + 25.0 * std::cos(3.0 * turn),
                  0.95 + 0.06 * i, 32.0 * std::cos(turn), 32.0 * std::sin(turn), 3.0 * i}));
  }
  return result;
}

/// What the images of a session hold where nothing else is said.
inline BoardImageOptions session_options(const std::optional<LaserPlane>& laser) {
  BoardImageOptions options;
  options.samples = 3;
  options.noise_dn = 1.5;
  options.white_dn = 130.0;
  options.laser = laser;
  options.laser_dn = 110.0;
  return options;
}

/// The images of a session, named `NAME0`, `NAME1`, ...
inline std::vector<SessionImage> render_session(const SyntheticStriper& striper,
                                                const std::string& name,
                                                const BoardImageOptions& options) {
  std::vector<SessionImage> images;
  for (const Eigen::Isometry3d& T : session_poses(striper))
    images.emplace_back(name + std::to_string(images.size()),
                        render_board(striper.camera, striper.board, T, options));
  return images;
}

inline std::vector<SessionImage> render_session(const SyntheticStriper& striper,
                                                const std::string& name,
                                                const std::optional<LaserPlane>& laser) {
  return render_session(striper, name, session_options(laser));
}

}  // namespace striper::testing
