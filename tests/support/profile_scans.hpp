// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include <striper/scan/polar_scan.hpp>

#include "support/random.hpp"

namespace striper::testing {

/// A root mean square.
class Rms {
 public:
  void add(double value) {
    sum_ += value * value;
    ++count_;
  }
  double value() const { return std::sqrt(sum_ / count_); }
  int count() const { return count_; }

 private:
  double sum_ = 0.0;
  int count_ = 0;
};

/// Scans of exact geometry with the noise of docs/accuracy.md: the row of every column is off by a
/// Gaussian of `row_sigma_px`, everything else is exact. The striper is `paper_model()`: 640
/// columns, 55 degrees, the camera .5 m above the plane.
struct ProfileStriper {
  int columns = 640;
  double focal_px = 320.0 / std::tan(55.0 * std::numbers::pi / 360.0);
  double baseline_m = 0.5;
  double row_sigma_px = 0.1;

  /// Columns run from left (positive bearings) to right.
  double bearing_rad(std::size_t column) const {
    return -std::atan((static_cast<double>(column) - 0.5 * (columns - 1)) / focal_px);
  }
  /// One sigma of 1/range of a column.
  double sigma_q(std::size_t column) const {
    return row_sigma_px * std::cos(bearing_rad(column)) / (focal_px * baseline_m);
  }
  double sigma_m(std::size_t column, double range_m) const {
    return range_m * range_m * sigma_q(column);
  }
};

/// The exact range of a column; NaN where there is nothing.
using ProfileShape = std::function<double(double bearing_rad)>;

/// The range at which a ray meets the line n . p = d; NaN where it does not.
inline double range_of_line(double bearing_rad, double normal_rad, double distance_m) {
  const double facing = std::cos(bearing_rad - normal_rad);
  return facing > 0.0 ? distance_m / facing : std::numeric_limits<double>::quiet_NaN();
}

inline Return return_at(const ProfileStriper& striper, std::size_t column, double range_m) {
  Return r;
  const double b = striper.bearing_rad(column);
  r.u_px = static_cast<double>(column);
  if (!(range_m > 0.0)) return r;
  r.v_px = 239.5 + striper.focal_px * striper.baseline_m / (range_m * std::cos(b));
  r.bearing_rad = b;
  r.range_m = range_m;
  r.sigma_m = striper.sigma_m(column, range_m);
  r.x_m = range_m * std::cos(b);
  r.y_m = range_m * std::sin(b);
  r.row_sigma_px = static_cast<float>(striper.row_sigma_px);
  r.confidence = 1.0F;
  r.status = ReturnStatus::kOk;
  return r;
}

/// Fills `scan` with the shape under fresh noise.
/// @param ranges_m exact, one per column; NaN where there is nothing.
inline void noisy_scan(const ProfileStriper& striper, const std::vector<double>& ranges_m,
                       PolarScan& scan) {
  scan.returns.resize(ranges_m.size());
  for (std::size_t i = 0; i < ranges_m.size(); ++i) {
    const double q = 1.0 / ranges_m[i] + normal(0.0, striper.sigma_q(i));
    scan.returns[i] = return_at(striper, i, 1.0 / q);
  }
}

inline std::vector<double> exact_ranges(const ProfileStriper& striper, const ProfileShape& shape) {
  std::vector<double> ranges(static_cast<std::size_t>(striper.columns));
  for (std::size_t i = 0; i < ranges.size(); ++i) ranges[i] = shape(striper.bearing_rad(i));
  return ranges;
}

/// Puts a part of the returns anywhere between .5 and 4 m.
inline void add_gross_outliers(const ProfileStriper& striper, double part, PolarScan& scan) {
  for (std::size_t i = 0; i < scan.returns.size(); ++i)
    if (uniform(0.0, 1.0) < part) scan.returns[i] = return_at(striper, i, uniform(0.5, 4.0));
}

}  // namespace striper::testing
