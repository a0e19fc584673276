// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <striper/detect/curb_finding.hpp>

#include "profile/cutter.hpp"

namespace striper::detail {

/// Where two lines meet, scan frame. Precondition: they are not parallel.
Eigen::Vector2d meeting(const ScanLine& a, const ScanLine& b) noexcept;

/// A curb as three lines: their meetings are its vertices, so that lines fitted apart are the
/// polyline's best fit.
struct CurbLines {
  ScanLine road;
  ScanLine face;
  ScanLine top;

  bool do_meet() const noexcept;
  Eigen::Vector2d foot_m() const noexcept;
  Eigen::Vector2d edge_m() const noexcept;
  /// Foot, edge, lateral, height and face of `finding`, with their errors.
  /// @param along the direction of the road's line in which lateral grows.
  void describe(const Eigen::Vector2d& along, CurbFinding& finding) const noexcept;
};

/// A line through a point, for what is not seen well enough to be fitted.
/// @param sigma_m across it, at the point.
ScanLine line_through(const Eigen::Vector2d& at_m, const Eigen::Vector2d& direction, double sigma_m,
                      double sigma_rad) noexcept;

/// Squared misfit of what is no part of a surface, where all others scatter as they should: five
/// sigma.
inline constexpr double kStrayChi2 = 25.0;

/// p of 1/range = p . ray, for rays from the pivot.
Eigen::Vector2d parameters_of(const ScanLine& line, const Eigen::Vector2d& pivot_m) noexcept;

/// The squared residual of an element over its variance.
double misfit(const InverseRanges& ranges, std::size_t i, const ScanLine& line) noexcept;

/// Elements [from, to) of the ranges, road and top at their ends, in either order.
struct CurbReach {
  std::size_t from = 0;
  std::size_t to = 0;
  bool is_road_first = true;
};

/// Fits the lines again, with each return on the line that the vertices give it to.
class CurbRefiner {
 public:
  /// `lines` are better, or as they were where too few returns are on one. Allocates only while
  /// scans grow.
  void refine(const InverseRanges& ranges, const CurbReach& reach, CurbLines& lines);

 private:
  void share_out(const InverseRanges& ranges, const CurbReach& reach, const CurbLines& lines);
  void leave_out_strays(const InverseRanges& ranges, const CurbLines& lines);
  void leave_out_nose(const InverseRanges& ranges, const CurbLines& lines);
  bool fit(const InverseRanges& ranges, CurbLines& lines) const;

  std::array<std::vector<std::size_t>, 3> on_;  // Road, face, top.
  std::vector<double> misfits_;
};

}  // namespace striper::detail
