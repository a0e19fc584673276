// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>
#include <ceres/problem.h>

#include "adjust/joint_problem.hpp"

namespace striper::detail {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// One whitened residual's derivatives: by what is common to all views (camera, bend, planes), and
/// by the pose of its own view.
struct JacobianRow {
  Eigen::VectorXd shared;
  Vector6 own = Vector6::Zero();
  Eigen::Index pose = -1;  ///< -1: it depends on no pose (a prior).
};

/// A problem linearised at its state, held parameters left out.
struct Linearisation {
  /// Column of the common part -> camera parameter, then 2 of the bend, then 3 per plane.
  std::vector<int> parameter;
  std::vector<JacobianRow> rows;  ///< In the order of the problem's residuals.
  Eigen::Index poses = 0;

  Eigen::Index common() const noexcept { return static_cast<Eigen::Index>(parameter.size()); }
};

Linearisation linearise(ceres::Problem& problem, JointState& state);

/// The normal matrix in its arrow shape: the common block, each pose's block, and what joins them.
struct NormalArrow {
  Eigen::MatrixXd common;
  std::vector<Eigen::MatrixXd> join;  ///< common x 6.
  std::vector<Matrix6> pose;

  explicit NormalArrow(const Linearisation& linearisation);

  /// The information of the common part, the poses eliminated.
  Eigen::MatrixXd schur() const;
};

/// The inverse of an arrow, by blocks: the covariance of everything, poses included.
class ArrowInverse {
 public:
  /// @param common the inverse of `arrow.schur()`.
  ArrowInverse(const NormalArrow& arrow, Eigen::MatrixXd common);

  const Eigen::MatrixXd& common() const noexcept { return common_; }

  /// row' C row: the row's element of the diagonal of the hat matrix.
  double leverage(const JacobianRow& row) const;

 private:
  Eigen::MatrixXd common_;
  std::vector<Eigen::MatrixXd> gain_;  // 6 x common: what the common part does to a pose.
  std::vector<Matrix6> own_;           // Of a pose, the common part given.
};

}  // namespace striper::detail
