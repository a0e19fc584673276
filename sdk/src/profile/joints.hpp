// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <striper/profile/segments.hpp>

#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// Elements [from, to) of an InverseRanges on one line.
struct Run {
  std::size_t from = 0;
  std::size_t to = 0;
  LineFit fit;  // 1/distance = p0 cos + p1 sin.
  bool is_rough = false;
  double scale = 1.0;
  bool meets_next = false;  // The next run begins at a corner.
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

/// Tells corners from steps, and places corners.
class CornerSearch {
 public:
  /// Returns whether two runs are one bent surface: whether the best broken line without a step
  /// fits them nearly as well as both lines do. If so the cut is moved to its knot: which surface a
  /// return beside a corner is on is better told by the surfaces than by its own noise. The runs
  /// are else unchanged. 5 us; allocates only while scans grow.
  bool settle(const InverseRanges& ranges, Run& left, Run& right);

 private:
  std::vector<LineSums> before_;
};

}  // namespace striper::detail
