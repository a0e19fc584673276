// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace striper::detail {

/// Standard normal distribution function, from a table with cubic interpolation: error below 1e-11.
double normal_cdf(double x) noexcept;

/// Its integral from minus infinity, x Phi(x) + phi(x); error below 1e-11 relative to max(1, x).
double normal_cdf_integral(double x) noexcept;

/// Mean of exp(-(x0 + a + b)^2 / 2) over |a| <= width_a / 2, |b| <= width_b / 2: a Gaussian ridge
/// averaged over a rectangle, in units of its standard deviation. Error below 1e-5, 1e-8 where the
/// widths are not small.
double mean_ridge(double x0, double width_a, double width_b) noexcept;

}  // namespace striper::detail
