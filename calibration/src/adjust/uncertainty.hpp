// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/adjust/solve_joint.hpp>

#include "adjust/normal_arrow.hpp"
#include "adjust/residuals.hpp"

namespace striper::detail {

/// Fills `solution` with how well the adjustment determines its unknowns: covariance, reciprocal
/// condition, weakest direction, and the degrees of freedom that each class of residuals keeps.
/// @param linearisation of the problem at `state`; its first rows are the corners', then the
/// stripes', as `counts` says, a prior's last.
void fill_uncertainty(const Linearisation& linearisation, const Counts& counts,
                      const JointState& state, JointSolution& solution);

/// Adds what the error of a camera that was held does to the result: d(planes) / d(camera), by the
/// implicit function theorem, where the poses and the bend follow.
/// @param freed the same problem with the camera free. @param camera_covariance of its parameters.
void add_known_camera(const Linearisation& freed, const Eigen::MatrixXd& camera_covariance,
                      const JointState& state, JointSolution& solution);

}  // namespace striper::detail
