// SPDX-License-Identifier: Apache-2.0
#include <striper/core/statistics.hpp>

namespace striper {

// By bisection: the last of 80 halves is below the double's own spacing.
double normal_quantile(double probability) noexcept {
  double low = -10.0;
  double high = 10.0;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (low + high);
    (normal_below(middle) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double chi2_quantile(double probability, double dof) noexcept {
  const double k = 2.0 / (9.0 * dof);
  return dof * std::pow(1.0 - k + normal_quantile(probability) * std::sqrt(k), 3.0);
}

}  // namespace striper
