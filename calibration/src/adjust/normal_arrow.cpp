// SPDX-License-Identifier: Apache-2.0
#include "adjust/normal_arrow.hpp"

#include <Eigen/Dense>
#include <ceres/crs_matrix.h>

namespace striper::detail {
namespace {

JacobianRow row_of(const ceres::CRSMatrix& J, int row, Eigen::Index common) {
  JacobianRow result;
  result.shared = Eigen::VectorXd::Zero(common);
  const auto r = static_cast<std::size_t>(row);
  for (int k = J.rows[r]; k < J.rows[r + 1]; ++k) {
    const Eigen::Index column = J.cols[static_cast<std::size_t>(k)];
    const double value = J.values[static_cast<std::size_t>(k)];
    if (column < common) {
      result.shared[column] = value;
    } else {
      result.pose = (column - common) / 6;
      result.own[(column - common) % 6] = value;
    }
  }
  return result;
}

}  // namespace

Linearisation linearise(ceres::Problem& problem, JointState& state) {
  ceres::Problem::EvaluateOptions options;
  options.apply_loss_function = false;
  Linearisation result;
  // Columns of the Jacobian in this order: camera, bend, planes, then the poses; held ones absent.
  const auto add = [&](double* block, int first, bool common) {
    if (problem.IsParameterBlockConstant(block)) return;
    options.parameter_blocks.push_back(block);
    const int free = problem.ParameterBlockTangentSize(block);
    for (int i = 0; common && i < free; ++i) result.parameter.push_back(first + i);
  };
  const int count = static_cast<int>(state.parameters.size());
  add(state.parameters.data(), 0, true);
  add(state.bend.data(), count, true);
  for (std::size_t i = 0; i < state.planes.size(); ++i)
    add(state.planes[i].data(), count + 2 + 3 * static_cast<int>(i), true);
  for (PoseBlock& pose : state.poses) add(pose.data(), 0, false);

  ceres::CRSMatrix J;
  problem.Evaluate(options, nullptr, nullptr, nullptr, &J);
  result.poses = (J.num_cols - result.common()) / 6;
  result.rows.reserve(static_cast<std::size_t>(J.num_rows));
  for (int row = 0; row < J.num_rows; ++row) result.rows.push_back(row_of(J, row, result.common()));
  return result;
}

NormalArrow::NormalArrow(const Linearisation& linearisation)
    : common(Eigen::MatrixXd::Zero(linearisation.common(), linearisation.common())),
      join(static_cast<std::size_t>(linearisation.poses),
           Eigen::MatrixXd::Zero(linearisation.common(), 6)),
      pose(static_cast<std::size_t>(linearisation.poses), Matrix6::Zero()) {
  for (const JacobianRow& row : linearisation.rows) {
    common.noalias() += row.shared * row.shared.transpose();
    if (row.pose < 0) continue;
    const auto i = static_cast<std::size_t>(row.pose);
    join[i].noalias() += row.shared * row.own.transpose();
    pose[i].noalias() += row.own * row.own.transpose();
  }
}

Eigen::MatrixXd NormalArrow::schur() const {
  Eigen::MatrixXd matrix = common;
  for (std::size_t i = 0; i < pose.size(); ++i)
    matrix -= join[i] * pose[i].ldlt().solve(join[i].transpose());
  return matrix;
}

ArrowInverse::ArrowInverse(const NormalArrow& arrow, Eigen::MatrixXd common)
    : common_(std::move(common)) {
  for (std::size_t i = 0; i < arrow.pose.size(); ++i) {
    own_.emplace_back(arrow.pose[i].ldlt().solve(Matrix6::Identity()));
    gain_.emplace_back(-own_[i] * arrow.join[i].transpose());
  }
}

double ArrowInverse::leverage(const JacobianRow& row) const {
  if (row.pose < 0) return row.shared.dot(common_ * row.shared);
  const auto i = static_cast<std::size_t>(row.pose);
  const Eigen::VectorXd through = row.shared + gain_[i].transpose() * row.own;
  return through.dot(common_ * through) + row.own.dot(own_[i] * row.own);
}

}  // namespace striper::detail
