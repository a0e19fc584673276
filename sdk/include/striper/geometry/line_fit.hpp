// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace striper {

/// What a weighted least squares fit of z = p0 f + p1 g found.
struct LineFit {
  Eigen::Vector2d parameters = Eigen::Vector2d::Zero();  ///< p0, p1.
  Eigen::Matrix2d covariance =
      Eigen::Matrix2d::Zero();  ///< Of both, if the weights are 1 / variance.
  double chi2 = 0.0;            ///< Weighted sum of squared residuals; at least 0.
  int points = 0;
  bool is_determined = false;  ///< False: fewer than two different places; the rest is zero.

  int dof() const noexcept { return points - 2; }
  double at(double f, double g) const noexcept { return parameters[0] * f + parameters[1] * g; }
  /// The variance of `at`.
  double variance_at(double f, double g) const noexcept {
    return covariance(0, 0) * f * f + 2.0 * covariance(0, 1) * f * g + covariance(1, 1) * g * g;
  }
};

/// The sums from which straight lines are fitted: the project's one straight-line fit.
///
/// Fits z = p0 f + p1 g. A line y = p0 + p1 x has f = 1, g = x. A straight line of the laser plane
/// in polar coordinates is 1/range = p0 cos(bearing) + p1 sin(bearing), linear too, and there the
/// noise of a striper is Gaussian and does not depend on the line (it is the row that is noisy).
/// Sums of disjoint points add, so all fits of a series come from its prefix sums. Plain value.
struct LineSums {
  double ff = 0.0, fg = 0.0, gg = 0.0, fz = 0.0, gz = 0.0, zz = 0.0;
  int points = 0;

  /// @param weight 1 / variance of z.
  void add(double f, double g, double z, double weight) noexcept {
    ff += weight * f * f;
    fg += weight * f * g;
    gg += weight * g * g;
    fz += weight * f * z;
    gz += weight * g * z;
    zz += weight * z * z;
    ++points;
  }

  LineSums& operator-=(const LineSums& other) noexcept {
    ff -= other.ff;
    fg -= other.fg;
    gg -= other.gg;
    fz -= other.fz;
    gz -= other.gz;
    zz -= other.zz;
    points -= other.points;
    return *this;
  }

  /// Whether the points are at different places: a determinant this much smaller than what it is
  /// the difference of is rounding.
  bool is_determined() const noexcept { return determinant() > 1e-14 * ff * gg; }
  double determinant() const noexcept { return ff * gg - fg * fg; }

  /// The least chi2 of a line through the points; 0 where it is not determined. About 2 ns.
  double chi2() const noexcept {
    if (!is_determined()) return 0.0;
    const double explained = (fz * fz * gg - 2.0 * fz * gz * fg + gz * gz * ff) / determinant();
    return zz > explained ? zz - explained : 0.0;
  }

  /// The least squares line. About 20 ns, no allocation.
  LineFit solve() const noexcept;
};

}  // namespace striper
