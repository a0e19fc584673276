// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include <Eigen/Core>

#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// A circle through returns.
struct CircleFit {
  Eigen::Vector2d centre_m{0.0, 0.0};  // Scan frame.
  double radius_m = 0.0;
  bool is_hollow = false;                                // Its inside is seen.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // Of centre and radius, by the weights.
  double chi2 = 0.0;
  int points = 0;
  bool is_determined = false;  // False: too few, or not told from a straight line.

  int dof() const noexcept { return points - 3; }
};

/// Fits a circle to elements by weighted least squares along the rays, where the noise is: Gauss
/// and Newton's steps in the coefficients of a (t^2 + m^2) + b t + m + d = 0 about the chord (Pratt
/// 1987 has the same circles, flat ones too), of which the first is the algebraic fit. Where the
/// arc turns away from the camera to less than 3 degrees a return counts as at 3: beyond, a ray
/// may miss the circle by noise alone. About 40 ns per element and step, three to five steps; no
/// allocation.
/// @param elements  ascending.
/// @param start  a circle that is nearly this one, if there is one: saves steps.
CircleFit fit_circle(const InverseRanges& ranges, std::span<const std::size_t> elements,
                     const CircleFit& start = {}) noexcept;

/// How far element i lies beyond the circle along its ray, over its sigma. Large where the ray
/// misses the circle.
double misfit(const InverseRanges& ranges, std::size_t i, const CircleFit& circle) noexcept;

/// Where element i's ray meets the circle, as 1/distance, and the variance of that by the circle's
/// covariance; NaN where it misses.
struct OnCircle {
  double q;
  double variance;
};
OnCircle on_circle(const InverseRanges& ranges, std::size_t i, const CircleFit& circle) noexcept;

}  // namespace striper::detail
