// SPDX-License-Identifier: Apache-2.0
#include "profile/tools/calibration_modes.hpp"

#include <cmath>

#include <Eigen/Eigenvalues>

#include "profile/tools/patch.hpp"

namespace striper::detail {
namespace {

// Modes with less than this part of the largest variance are rounding. Parameters have different
// units, so the covariance is scaled to correlations first.
constexpr double kRounding = 1e-12;

// A root of a covariance: root * root' is it, without columns of zeros.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd inverse = sigma.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 0.0; });
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(inverse.asDiagonal() * covariance *
                                                              inverse.asDiagonal());
  const Eigen::VectorXd& values = solver.eigenvalues();
  Eigen::MatrixXd root(covariance.rows(), 0);
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    if (values[k] <= kRounding * values.tail(1).value()) continue;
    root.conservativeResize(Eigen::NoChange, root.cols() + 1);
    root.rightCols(1) = std::sqrt(values[k]) * (sigma.asDiagonal() * solver.eigenvectors().col(k));
  }
  return root;
}

}  // namespace

CalibrationModes::CalibrationModes(const Triangulator& triangulator)
    : triangulator_(triangulator), root_(root_of(triangulator.covariance())) {}

bool CalibrationModes::take(const PolarScan& scan, const InverseRanges& ranges) {
  shifts_.resize(ranges.size());
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const Return& r = scan.returns[ranges.index[i]];
    const Eigen::Vector2d pixel(r.u_px, r.v_px);
    if (!pixel.allFinite() || triangulator_.triangulate(pixel).status != ReturnStatus::kOk)
      return false;
    const TriangulationGradient g = triangulator_.gradient(pixel);
    Eigen::Matrix2Xd all(2, root_.rows());
    all << g.d_camera, g.d_plane;
    shifts_[i] = all * root_;
  }
  return true;
}

void CalibrationModes::move(const InverseRanges& ranges, std::size_t k, double sigmas,
                            InverseRanges& moved) const {
  moved = ranges;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const Eigen::Vector2d from_pivot =
        point_of(ranges, i) - ranges.pivot + sigmas * shifts_[i].col(static_cast<Eigen::Index>(k));
    moved.q[i] = 1.0 / from_pivot.norm();
    moved.cosine[i] = from_pivot.x() * moved.q[i];
    moved.sine[i] = from_pivot.y() * moved.q[i];
  }
}

}  // namespace striper::detail
