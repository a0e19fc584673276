// SPDX-License-Identifier: Apache-2.0
#include "adjust/uncertainty.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <fmt/format.h>

namespace striper::detail {
namespace {

constexpr double kSingular = 1e-13;  // Below this reciprocal condition no covariance is formed.

std::vector<std::string> reduced_names(const CameraModel& camera, std::size_t planes) {
  std::vector<std::string> names;
  for (const auto name : camera.parameter_names()) names.emplace_back(name);
  names.insert(names.end(), {"bend_x", "bend_y"});
  for (std::size_t i = 0; i < planes; ++i)
    for (const char axis : {'x', 'y', 'z'}) names.push_back(fmt::format("laser{}_{}", i, axis));
  return names;
}

// d (n, d) / d w for w = n / d.
Eigen::Matrix<double, 4, 3> plane_jacobian(const std::array<double, 3>& block) {
  const Eigen::Vector3d w(block[0], block[1], block[2]);
  const double d = 1.0 / w.norm();
  const Eigen::Vector3d n = d * w;
  Eigen::Matrix<double, 4, 3> J;
  J.topRows<3>() = d * (Eigen::Matrix3d::Identity() - n * n.transpose());
  J.row(3) = -d * d * n.transpose();
  return J;
}

// From the solver's unknowns to the model file's.
Eigen::MatrixXd file_covariance(const Linearisation& linearisation, const Eigen::MatrixXd& common,
                                const JointState& state) {
  const auto camera = static_cast<Eigen::Index>(state.parameters.size());
  const auto planes = static_cast<Eigen::Index>(state.planes.size());
  Eigen::MatrixXd to_file = Eigen::MatrixXd::Zero(camera + 4 * planes, common.rows());
  for (Eigen::Index column = 0; column < common.cols(); ++column) {
    const Eigen::Index parameter = linearisation.parameter[static_cast<std::size_t>(column)];
    if (parameter < camera) {
      to_file(parameter, column) = 1.0;
    } else if (parameter >= camera + 2) {
      const Eigen::Index plane = (parameter - camera - 2) / 3;
      to_file.block<4, 1>(camera + 4 * plane, column) =
          plane_jacobian(state.planes[static_cast<std::size_t>(plane)])
              .col((parameter - camera - 2) % 3);
    }
  }
  const Eigen::MatrixXd covariance = to_file * common * to_file.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

std::vector<std::pair<std::string, double>> by_weight(const Linearisation& linearisation,
                                                      const JointState& state,
                                                      const Eigen::VectorXd& direction) {
  const std::vector<std::string> names = reduced_names(state.camera, state.planes.size());
  std::vector<std::pair<std::string, double>> weights;
  for (Eigen::Index i = 0; i < direction.size(); ++i)
    weights.emplace_back(
        names[static_cast<std::size_t>(linearisation.parameter[static_cast<std::size_t>(i)])],
        std::abs(direction[i]));
  std::sort(weights.begin(), weights.end(),
            [](const auto& a, const auto& b) { return a.second > b.second; });
  return weights;
}

// One sigma of each unknown with the others held; 0 where the poses take all of its information, so
// that what is left is rounding, of either sign.
Eigen::VectorXd sigmas_alone(const Eigen::MatrixXd& information, const Eigen::MatrixXd& before) {
  Eigen::VectorXd sigmas = Eigen::VectorXd::Zero(information.rows());
  for (Eigen::Index i = 0; i < sigmas.size(); ++i)
    if (information(i, i) > std::numeric_limits<double>::epsilon() * before(i, i))
      sigmas[i] = 1.0 / std::sqrt(information(i, i));
  return sigmas;
}

// The stripes take part in the poses too: each class loses the unknowns that it determines, the
// trace of its part of the hat matrix.
void fill_degrees_of_freedom(const Linearisation& linearisation, const Counts& counts,
                             const ArrowInverse& inverse, JointSolution& solution) {
  const auto corners = static_cast<std::size_t>(counts.corner_numbers);
  const auto all = corners + static_cast<std::size_t>(counts.stripe_numbers);
  double corner_share = 0.0;
  double stripe_share = 0.0;
  for (std::size_t row = 0; row < std::min(linearisation.rows.size(), all); ++row)
    (row < corners ? corner_share : stripe_share) += inverse.leverage(linearisation.rows[row]);
  if (!std::isfinite(corner_share) || !std::isfinite(stripe_share)) return;
  solution.corners.dof = counts.corner_numbers - corner_share;
  if (counts.stripe_numbers > 0.0) solution.stripes.dof = counts.stripe_numbers - stripe_share;
}

}  // namespace

void fill_uncertainty(const Linearisation& linearisation, const Counts& counts,
                      const JointState& state, JointSolution& solution) {
  const Eigen::Index size = linearisation.common();
  if (size == 0) return;
  const NormalArrow arrow(linearisation);
  const Eigen::MatrixXd information = arrow.schur();
  if (!information.allFinite()) return;
  const Eigen::VectorXd scale = sigmas_alone(information, arrow.common);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      Eigen::MatrixXd(scale.asDiagonal() * information * scale.asDiagonal()));
  const double least = eigen.eigenvalues()[0];
  solution.rcond = least > 0.0 ? least / eigen.eigenvalues()[size - 1] : 0.0;
  solution.weakest = by_weight(linearisation, state, eigen.eigenvectors().col(0));
  if (solution.rcond < kSingular) return;
  const Eigen::MatrixXd root = scale.asDiagonal() * eigen.eigenvectors() *
                               eigen.eigenvalues().cwiseSqrt().cwiseInverse().asDiagonal();
  const ArrowInverse inverse(arrow, root * root.transpose());
  const auto camera = static_cast<int>(state.parameters.size());
  for (Eigen::Index i = 0; i + 1 < size; ++i)
    if (linearisation.parameter[static_cast<std::size_t>(i)] == camera)
      solution.bend_covariance = inverse.common().block<2, 2>(i, i);
  solution.covariance = file_covariance(linearisation, inverse.common(), state);
  // A lens that has run away from a few corners can pass the test above and leave no figures.
  if (!solution.covariance.allFinite() || solution.covariance.diagonal().minCoeff() < 0.0)
    solution.covariance.resize(0, 0);
  fill_degrees_of_freedom(linearisation, counts, inverse, solution);
}

void add_known_camera(const Linearisation& freed, const Eigen::MatrixXd& camera_covariance,
                      const JointState& state, JointSolution& solution) {
  if (solution.covariance.size() == 0 && !state.planes.empty()) return;
  const Eigen::MatrixXd information = NormalArrow(freed).schur();
  const Eigen::Index camera = camera_covariance.rows();
  const Eigen::Index others = freed.common() - camera;
  Eigen::MatrixXd common = Eigen::MatrixXd::Zero(freed.common(), camera);  // By the camera.
  common.topRows(camera).setIdentity();
  if (others > 0)
    common.bottomRows(others) = -information.bottomRightCorner(others, others)
                                     .ldlt()
                                     .solve(information.bottomLeftCorner(others, camera));
  solution.from_known_camera =
      file_covariance(freed, common * camera_covariance * common.transpose(), state);
  if (solution.covariance.size() == 0)
    solution.covariance = solution.from_known_camera;
  else
    solution.covariance += solution.from_known_camera;
}

}  // namespace striper::detail
