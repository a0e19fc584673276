// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

namespace striper {

/// The probability that a standard normal variable is below z. To 1e-16.
inline double normal_below(double z) noexcept { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

/// That it is above; exact far out, where 1 - normal_below would be 0.
inline double normal_above(double z) noexcept { return 0.5 * std::erfc(z / std::numbers::sqrt2); }

/// What a standard normal variable is below with this probability, to 1e-16 between -10 and 10.
/// 2 us.
double normal_quantile(double probability) noexcept;

/// Quantile of the chi-square distribution (Wilson & Hilferty 1931: within 0.006 in probability for
/// dof >= 3).
double chi2_quantile(double probability, double dof) noexcept;

}  // namespace striper
