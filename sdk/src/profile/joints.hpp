// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <striper/profile/segments.hpp>

#include "profile/circle_fit.hpp"
#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// Where a bent line bends, as a mean over all places, each as likely as the returns make it.
struct Knot {
  Eigen::Vector2d direction{1.0, 0.0};  // From the pivot, unit vector.
  double sigma_rad = 0.0;
};

/// Elements [from, to) of an InverseRanges on one line or circle.
struct Run {
  std::size_t from = 0;
  std::size_t to = 0;
  LineFit fit;  // 1/distance = p0 cos + p1 sin.
  bool is_rough = false;
  double scale = 1.0;
  bool is_circular = false;  // On `circle`; `fit` is then the best straight line,
  CircleFit circle{};        // and this where they are.
  bool meets_next = false;   // The next run begins at a corner,
  Knot knot{};               // which is here.
};

/// Fits elements [from, to), in coordinates in which short runs lose no digits.
LineFit fit_run(const InverseRanges& ranges, std::size_t from, std::size_t to) noexcept;

/// The same of any elements, ascending.
LineFit fit_elements(const InverseRanges& ranges, std::span<const std::size_t> elements) noexcept;

/// Where two lines meet, seen from the pivot.
struct Meeting {
  Eigen::Vector2d direction{1.0, 0.0};  // Unit vector.
  double sigma_rad = 0.0;               // Of the direction.
  Eigen::Vector2d point_m{0.0, 0.0};    // From the pivot.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  bool exists = false;  // In front of the pivot, about where the left run ends.
};

Meeting meet(const InverseRanges& ranges, const Run& left, const Run& right) noexcept;

/// The same of runs that CornerSearch has settled. Where the place is known to some columns only,
/// left.knot is better than where the lines meet: the lines are those of one cut, and which return
/// is on which of them is as uncertain as the corner (at a chi2 gain of 100 it is off by 1.1 times
/// the bound instead of 1.2, and says so).
Meeting meet_at_knot(const InverseRanges& ranges, const Run& left, const Run& right) noexcept;

/// Tells corners from steps, and places corners.
class CornerSearch {
 public:
  /// Returns whether two runs are one bent surface: whether the best broken line without a step
  /// fits them nearly as well as both lines do. If so the cut is moved to its knot: which surface a
  /// return beside a corner is on is better told by the surfaces than by its own noise. The runs
  /// are else unchanged. 5 us; allocates only while scans grow.
  bool settle(const InverseRanges& ranges, Run& left, Run& right);

 private:
  Knot knot_of(const InverseRanges& ranges, std::size_t about, std::size_t from) const;

  std::vector<LineSums> before_;
  std::vector<double> likelihood_;  // Its logarithm, of the bent line with its knot at each return.
};

}  // namespace striper::detail
