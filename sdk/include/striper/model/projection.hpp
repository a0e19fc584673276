// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <Eigen/Core>

#include <striper/model/camera_model.hpp>

// The lens formulas, once, for every number type that has + - * / sqrt atan2: double, ceres::Jet,
// Eigen::AutoDiffScalar. All functions are pure and thread-safe and allocate nothing. They answer
// outside of the one-to-one region too: `CameraModel` is what checks it.

namespace striper {

/// The factor g of the radial part of plumb_bob and rational_polynomial: r_distorted = r g(r^2).
/// @param k the distortion coefficients in OpenCV's order.
template <typename T>
T radial_factor(LensModel lens, const T* k, const T& r2) {
  T numerator = T(1.0) + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  if (lens != LensModel::kRationalPolynomial) return numerator;
  const T denominator = T(1.0) + r2 * (k[5] + r2 * (k[6] + r2 * k[7]));
  return numerator / denominator;
}

/// The distorted angle of an equidistant lens: theta (1 + k1 theta^2 + ... + k4 theta^8).
/// Kannala & Brandt 2006, eq. 6.
template <typename T>
T equidistant_angle(const T* k, const T& theta) {
  const T t2 = theta * theta;
  return theta * (T(1.0) + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
}

/// The distorted point of an equidistant lens.
template <typename T>
Eigen::Matrix<T, 2, 1> distort_equidistant(const T* k, const Eigen::Matrix<T, 2, 1>& xy) {
  using std::atan2;
  using std::sqrt;
  const T r2 = xy.x() * xy.x() + xy.y() * xy.y();
  // Near the axis sqrt has no derivative; there atan(r) / r = 1 - r^2 / 3 + ..., exact to a bit.
  if (r2 < 1e-8) {
    const T theta_over_r = T(1.0) + r2 * (T(-1.0 / 3.0) + r2 * T(0.2));
    const T t2 = r2 * theta_over_r * theta_over_r;
    const T scale = theta_over_r * (T(1.0) + t2 * (k[0] + t2 * k[1]));
    return {xy.x() * scale, xy.y() * scale};
  }
  const T r = sqrt(r2);
  const T theta = atan2(r, T(1.0));
  const T scale = equidistant_angle(k, theta) / r;
  return {xy.x() * scale, xy.y() * scale};
}

/// The distorted normalised point of the ray (x, y, 1).
/// @param k `distortion_count(lens)` coefficients in OpenCV's order.
template <typename T>
Eigen::Matrix<T, 2, 1> distort(LensModel lens, const T* k, const Eigen::Matrix<T, 2, 1>& xy) {
  if (lens == LensModel::kEquidistant) return distort_equidistant(k, xy);
  const T& x = xy.x();
  const T& y = xy.y();
  const T xx = x * x;
  const T yy = y * y;
  const T xy2 = T(2.0) * x * y;
  const T r2 = xx + yy;
  const T g = radial_factor(lens, k, r2);
  const T& p1 = k[2];
  const T& p2 = k[3];
  return {x * g + p1 * xy2 + p2 * (r2 + T(2.0) * xx), y * g + p1 * (r2 + T(2.0) * yy) + p2 * xy2};
}

/// The full-sensor pixel of the ray (x, y, 1).
/// @param parameters fx, fy, cx, cy and the distortion, as `CameraModel::parameters`.
template <typename T>
Eigen::Matrix<T, 2, 1> project_normalized(LensModel lens, const T* parameters,
                                          const Eigen::Matrix<T, 2, 1>& xy) {
  const Eigen::Matrix<T, 2, 1> distorted = distort(lens, parameters + 4, xy);
  return {parameters[0] * distorted.x() + parameters[2],
          parameters[1] * distorted.y() + parameters[3]};
}

/// The full-sensor pixel of a point of the camera frame, z > 0.
template <typename T>
Eigen::Matrix<T, 2, 1> project_point(LensModel lens, const T* parameters,
                                     const Eigen::Matrix<T, 3, 1>& p_cam) {
  const Eigen::Matrix<T, 2, 1> xy(p_cam.x() / p_cam.z(), p_cam.y() / p_cam.z());
  return project_normalized(lens, parameters, xy);
}

}  // namespace striper
