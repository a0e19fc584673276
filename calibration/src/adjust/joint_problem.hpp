// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <ceres/problem.h>

#include <striper/adjust/solve_joint.hpp>
#include <striper/board/observations.hpp>

#include "adjust/cost_functions/board_pose.hpp"

namespace striper::detail {

/// The unknowns of an adjustment, laid out as the solver's blocks.
struct JointState {
  CameraModel camera;  ///< Says the lens and the image size; the numbers are in `parameters`.
  std::vector<double> parameters;
  std::vector<PoseBlock> poses;
  std::array<double, 2> bend{};
  std::vector<std::array<double, 3>> planes;  ///< w = n / d.

  void set_camera(const CameraModel& start);
  CameraModel camera_now() const;
};

/// Which points take part, and with what sigma.
struct JointWeights {
  double corner_sigma_px = 0.1;
  double stripe_factor = 1.0;
  std::vector<std::vector<char>> corner_used;
  std::vector<std::vector<char>> stripe_used;
};

/// The plane as the solver has it, from normal and distance, and back with d > 0.
std::array<double, 3> to_block(const LaserPlane& plane);
LaserPlane to_plane(const std::array<double, 3>& block);

/// Builds the least-squares problem on `state`'s memory.
/// @param loss_sigmas residuals beyond it count less (Huber); 0: plain least squares.
std::unique_ptr<ceres::Problem> make_problem(const Observations& observations,
                                             const JointOptions& options,
                                             const JointWeights& weights, double loss_sigmas,
                                             JointState& state);

/// One stripe pixel against the stripe that the state predicts in its column or row.
struct StripeResidual {
  double residual_px;   ///< Observed minus predicted.
  double skew_px;       ///< How far beside the middle of the laser plane it should be.
  Eigen::Vector2d ray;  ///< Of the middle of the laser plane: a start for the next search.
};

/// Empty where the state predicts no stripe there.
/// @param point which of the stripe's.
std::optional<StripeResidual> stripe_residual(const JointState& state, const Board& board,
                                              StripeAxis axis, const PoseBlock& pose,
                                              const StripeView& stripe, std::size_t point);

/// Projected minus observed corner (or dot), px; NaN behind the camera.
/// @param point which of the board's points.
Eigen::Vector2d corner_residual(const JointState& state, const Board& board, const PoseBlock& pose,
                                int point, const Eigen::Vector2d& pixel);

}  // namespace striper::detail
