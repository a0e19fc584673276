// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Dense>

#include <striper/adjust/solve_joint.hpp>
#include <striper/geometry/triangulator.hpp>

#include "support/striper_session.hpp"

namespace striper::testing {

/// An orthonormal 4x3 basis of a plane's three degrees of freedom (normal and distance).
inline Eigen::Matrix<double, 4, 3> plane_tangent(const LaserPlane& plane) {
  const Eigen::Vector3d& n = plane.normal();
  const Eigen::Vector3d a = n.unitOrthogonal();
  Eigen::Matrix<double, 4, 3> basis = Eigen::Matrix<double, 4, 3>::Zero();
  basis.col(0).head<3>() = a;
  basis.col(1).head<3>() = n.cross(a);
  basis(3, 2) = 1.0;
  return basis;
}

/// Estimate (or its difference to another) on the free parameters: those of the camera in `free`,
/// then three of the plane.
inline Eigen::MatrixXd to_free(const CameraModel& camera, const LaserPlane& plane,
                               const std::vector<int>& free) {
  const auto count = camera.parameters().size();
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(free.size()) + 3, count + 4);
  for (std::size_t i = 0; i < free.size(); ++i) S(static_cast<Eigen::Index>(i), free[i]) = 1.0;
  S.block<3, 4>(static_cast<Eigen::Index>(free.size()), count) = plane_tangent(plane).transpose();
  return S;
}

inline Eigen::VectorXd stacked(const CameraModel& camera, const LaserPlane& plane) {
  const Eigen::VectorXd c = camera.parameters();
  Eigen::VectorXd all(c.size() + 4);
  all << c, plane.normal(), plane.distance_m();
  return all;
}

/// Upper tail of the chi-square distribution, by the incomplete gamma function (series and
/// continued fraction).
inline double chi2_cdf(double x, double dof) {
  const double a = 0.5 * dof;
  const double z = 0.5 * x;
  if (z <= 0.0) return 0.0;
  double sum = 1.0 / a;
  double term = sum;
  if (z < a + 1.0) {
    for (int n = 1; n < 500; ++n) {
      term *= z / (a + n);
      sum += term;
      if (term < 1e-15 * sum) break;
    }
    return sum * std::exp(-z + a * std::log(z) - std::lgamma(a));
  }
  double b = z + 1.0 - a;
  double c = 1e300;
  double d = 1.0 / b;
  double h = d;
  for (int i = 1; i < 500; ++i) {
    const double an = -i * (i - a);
    b += 2.0;
    d = 1.0 / (an * d + b);
    c = b + an / c;
    h *= d * c;
    if (std::abs(d * c - 1.0) < 1e-15) break;
  }
  return 1.0 - h * std::exp(-z + a * std::log(z) - std::lgamma(a));
}

/// p-value of the one-sample Kolmogorov-Smirnov test of values in [0, 1] against uniform
/// (asymptotic, Stephens' correction).
inline double ks_p_value(std::vector<double> u) {
  std::sort(u.begin(), u.end());
  const auto n = static_cast<double>(u.size());
  double distance = 0.0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    distance = std::max(distance, static_cast<double>(i + 1) / n - u[i]);
    distance = std::max(distance, u[i] - static_cast<double>(i) / n);
  }
  const double lambda = (std::sqrt(n) + 0.12 + 0.11 / std::sqrt(n)) * distance;
  double p = 0.0;
  for (int k = 1; k <= 100; ++k)
    p += (k % 2 == 1 ? 2.0 : -2.0) * std::exp(-2.0 * k * k * lambda * lambda);
  return std::clamp(p, 0.0, 1.0);
}

/// The pixel of a striper that sees the laser plane straight ahead at a range.
inline Eigen::Vector2d pixel_at_range(const StriperModel& truth, double range_m) {
  return Triangulator(truth, 0).project(range_m, 0.0).pixel;
}

inline StriperModel model_of(const CameraModel& camera, const LaserPlane& plane) {
  StriperModel model;
  model.camera = camera;
  model.lasers.push_back({plane, std::nullopt, std::nullopt});
  model.axis = StripeAxis::kColumns;
  return model;
}

inline StriperModel model_of(const JointSolution& solution) {
  StriperModel model = model_of(solution.camera, solution.planes.at(0));
  model.covariance = ModelCovariance{covariance_names(solution.camera, 1), solution.covariance};
  return model;
}

inline double rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

}  // namespace striper::testing
