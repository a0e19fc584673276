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
  LineFit fit;                     // 1/distance = p0 cos + p1 sin.
  std::size_t mixed_at_begin = 0;  // Elements there that see both sides of a corner: on this
  std::size_t mixed_at_end = 0;    // surface, but not in `fit`.
  bool is_rough = false;
  double scale = 1.0;
  bool is_circular = false;  // On `circle`; `fit` is then the best straight line,
  CircleFit circle{};        // and this where they are.
  bool meets_next = false;   // The next run begins at a corner,
  Knot knot{};               // which is here.
};

/// Fits elements [from, to), in coordinates in which short runs lose no digits.
LineFit fit_run(const InverseRanges& ranges, std::size_t from, std::size_t to) noexcept;

/// The same of a run, without columns that see both sides of a corner.
LineFit fit_run(const InverseRanges& ranges, const Run& run) noexcept;

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

/// Whether the few elements of a run between two others are no surface of their own, but columns
/// that see both sides of the corner at which those meet: each lies between the surface that it is
/// on and twice as far off it as the blur of lens and column carries it.
bool is_blurred_corner(const InverseRanges& ranges, const Run& left, const Run& between,
                       const Run& right) noexcept;

/// Tells corners from steps, and places corners.
class CornerSearch {
 public:
  /// Returns whether two runs are one bent surface: whether the best broken line without a step
  /// fits them nearly as well as both lines do. If so the cut is moved to its knot: which surface a
  /// return beside a corner is on is better told by the surfaces than by its own noise. And the two
  /// columns beside a sharp corner, which see both sides of it and so lie between them, are left
  /// out of the lines. The runs are else unchanged. 5 us; allocates only while scans grow.
  bool settle(const InverseRanges& ranges, Run& left, Run& right);

 private:
  void take_sums(const InverseRanges& ranges, const Run& left, const Run& right);
  LineSums sums(std::size_t from, std::size_t to) const noexcept;
  void cut_run_pair(const InverseRanges& ranges, std::size_t cut, Run& left, Run& right) const;
  double chi2_if_met_at(const InverseRanges& ranges, std::size_t cut, const Run& left,
                        const Run& right) const noexcept;
  void try_knots(const InverseRanges& ranges, const Run& left, const Run& right);
  bool settle_at(const InverseRanges& ranges, std::size_t knot, Run& left, Run& right) const;
  void leave_out_mixed(const InverseRanges& ranges, Run& left, Run& right) const;
  Knot knot_of(const InverseRanges& ranges) const;

  std::size_t first_ = 0;           // The element of the first sums,
  std::size_t about_ = 0;           // and that whose direction they are about.
  std::vector<LineSums> before_;    // Prefix sums.
  std::size_t first_knot_ = 0;      // The element of the first likelihood.
  std::vector<double> likelihood_;  // Its logarithm, of the bent line with its knot at each return.
  double least_chi2_ = 0.0;         // Of these bent lines,
  std::size_t least_knot_ = 0;      // and where.
};

}  // namespace striper::detail
