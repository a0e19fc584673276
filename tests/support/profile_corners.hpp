// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include <striper/geometry/line_fit.hpp>

#include "support/profile_scans.hpp"

namespace striper::testing {

/// A concave room corner at (2 m, y_m), both walls `bend_rad` / 2 off the straight line.
inline std::vector<double> corner_ranges(const ProfileStriper& striper, double bend_rad,
                                         double y_m = 0.0) {
  const double at_rad = std::atan2(y_m, 2.0);
  return exact_ranges(striper, [&](double b) {
    const double normal = b > at_rad ? 0.5 * bend_rad : -0.5 * bend_rad;
    return range_of_line(b, normal, 2.0 * std::cos(normal) + y_m * std::sin(normal));
  });
}

inline void add_column(const ProfileStriper& striper, const std::vector<double>& ranges,
                       std::size_t column, LineSums& sums) {
  const double b = striper.bearing_rad(column);
  sums.add(std::cos(b), std::sin(b), 1.0 / ranges[column], std::pow(striper.sigma_q(column), -2.0));
}

/// chi2 that one straight line for all columns leaves, without noise.
inline double gain_of(const ProfileStriper& striper, const std::vector<double>& ranges) {
  LineSums sums;
  for (std::size_t i = 0; i < ranges.size(); ++i) add_column(striper, ranges, i, sums);
  return sums.chi2();
}

/// The bend of a corner at (2 m, y_m) whose chi2 gain is `gain`.
inline double bend_of_gain(const ProfileStriper& striper, double gain, double y_m = 0.0) {
  double low = 0.0;
  double high = 1.0;
  for (int round = 0; round < 40; ++round) {
    const double middle = 0.5 * (low + high);
    (gain_of(striper, corner_ranges(striper, middle, y_m)) < gain ? low : high) = middle;
  }
  return low;
}

}  // namespace striper::testing
