// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace striper::detail {

/// What was measured less what was predicted, and how much of that was to be expected.
struct Innovation {
  double value = 0.0;
  double variance = 0.0;

  /// Chi-square, 1 degree of freedom, where all is as it was thought to be.
  double square() const noexcept { return value * value / variance; }
};

/// A Gaussian state that is predicted linearly and corrected by one number at a time.
///
/// @tparam kMost how many states there are, or at most where `kSize` is Eigen::Dynamic.
/// No allocation. Source: R. E. Kalman, *A new approach to linear filtering and prediction
/// problems*, 1960; scalar corrections one after the other are the same as all at once where the
/// measurements' errors are independent.
template <int kSize, int kMost = kSize>
struct KalmanState {
  using Vector = Eigen::Matrix<double, kSize, 1, 0, kMost, 1>;
  using Matrix = Eigen::Matrix<double, kSize, kSize, 0, kMost, kMost>;

  Vector mean;
  Matrix covariance;

  /// Of a measurement `h . state + noise`.
  Innovation innovation(const Vector& h, double measured, double variance) const noexcept {
    const Vector ph = covariance * h;
    return {measured - h.dot(mean), h.dot(ph) + variance};
  }

  /// Takes the measurement that the innovation is of.
  void correct(const Vector& h, const Innovation& innovation) noexcept {
    correct_by(covariance * h, innovation);
  }
  /// The same where `covariance * h` is known.
  void correct_by(const Vector& ph, const Innovation& innovation) noexcept {
    mean += ph * (innovation.value / innovation.variance);
    const Vector share = ph / std::sqrt(innovation.variance);
    covariance.noalias() -= share.lazyProduct(share.transpose());
  }

  /// Foretells: `advance` carries the state on, `noise` is what comes to its covariance.
  void predict(const Matrix& advance, const Matrix& noise) noexcept {
    mean = (advance * mean).eval();
    covariance = (advance * covariance * advance.transpose() + noise).eval();
  }
};

}  // namespace striper::detail
