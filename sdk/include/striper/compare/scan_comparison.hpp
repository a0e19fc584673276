// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <striper/scan/polar_scan.hpp>

namespace striper {

/// How scans are compared with those of another scanner.
struct CompareOptions {
  /// Whether the reference's ranges may all be off by the same amount, which is then estimated.
  bool reference_offset = false;
  /// The step in which the reference rounds its ranges, metres; 0: none. Its error is even over it.
  double reference_quantum_m = 0.0;
  /// The reference's own random error where its returns have none (`sigma_m`), metres.
  double reference_sigma_m = 0.0;
  /// Neighbours of the reference farther apart than this part of their range, and 30 mm, are not
  /// one surface. A scanner of one degree that sees a wall at 15 degrees has them .07 apart.
  double largest_gap = 0.08;
  /// What lies farther than this from the reference's surface is not the same thing, metres.
  double gate_m = 0.15;
  /// How far from the origin, and how much turned, the reference may stand.
  double search_m = 0.6;
  double search_rad = 0.35;

  /// @throws Error{kBadValue} naming the field, the value and the bound.
  void validate() const;
};

/// A pose in the plane, with the reference's offset, and how well they are known. NaN where there
/// is none.
struct PlanarPose {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_rad = 0.0;
  double sigma_x_m = kNone;
  double sigma_y_m = kNone;
  double sigma_yaw_rad = kNone;

  /// From the frame of the pose to the one that it is given in.
  Eigen::Vector2d operator*(const Eigen::Vector2d& point) const;
};

/// Why returns have no partner in the reference.
struct DroppedReturns {
  int not_visible = 0;  ///< The reference does not look there, or something else stands before it.
  int no_segment = 0;   ///< It has an edge there, or nothing: no surface to compare with.
  int status = 0;       ///< The return itself is not to be trusted.
};

/// A return and the reference's surface in its direction.
struct ComparedReturn {
  Eigen::Vector2d point_m;   ///< In the scan frame.
  double bearing_rad = 0.0;  ///< In the scan frame.
  double range_m = 0.0;
  double difference_m = 0.0;     ///< Range less the reference's along the same ray, scan frame.
  double sigma_m = 0.0;          ///< What both state of that difference.
  double expected_inside = 0.0;  ///< The chance that it is within 1.96 sigma, rounding being even.

  double pull() const noexcept { return difference_m / sigma_m; }
};

/// Differences of the returns whose bearing or range is from one value to another.
struct ComparisonBin {
  double from = 0.0;
  double to = 0.0;
  int count = 0;
  double median_m = 0.0;  ///< Of the differences.
  double sigma_m = 0.0;   ///< Of that median.
};

/// What returns of one status are worth: good ones should have next to no outliers, and those that
/// are doubtful for a reason, many.
struct StatusOutliers {
  ReturnStatus status = ReturnStatus::kOk;
  /// Those in whose direction the reference has a surface: however far before it, or as far behind
  /// it as the gate.
  int compared = 0;
  int outliers = 0;  ///< Farther from it than three sigma of what both state.
};

/// What a comparison says. @see compare_scans
struct ScanComparison {
  PlanarPose pose;                           ///< T_scan_reference.
  std::optional<double> reference_offset_m;  ///< What the reference's ranges are too short by.
  std::optional<double> sigma_offset_m;
  std::vector<ComparedReturn> pairs;
  DroppedReturns dropped;
  double pull_mean = 0.0;
  double pull_sd = 0.0;
  double inside_1_96 = 0.0;                    ///< Part of the pairs.
  double expected_inside_1_96 = 0.0;           ///< What the stated errors predict.
  std::vector<ComparisonBin> bias_by_bearing;  ///< rad.
  std::vector<ComparisonBin> bias_by_range;    ///< m.
  std::vector<StatusOutliers> outliers;        ///< Of each status that has ranges, in their order.
};

/// Compares scans with one of another scanner that stands elsewhere and sees differently.
///
/// Registration in the plane: each return, carried into the reference's frame, is compared with the
/// straight line through the reference's neighbouring returns about its bearing there (point to
/// line, Chen & Medioni 1992; pairs by bearing as in projective association, Blais & Levine 1995).
/// What the reference cannot see is dropped and counted. Cauchy weights; Gauss-Newton from several
/// starts; the covariance is that of clusters of neighbours (sandwich; White 1980), because
/// neighbours share their errors. Cost: about 15 ms for two scans of 640 returns.
/// Thread-safe.
/// @param scans of the striper, in one frame. @param reference one scan, in its own frame.
/// @throws Error{kBadValue} as the options, and where no ok return of `scans` has range_m
/// and sigma_m (others are left out);
/// Error{kUntrustworthy} where fewer than 30 pairs are
/// found, the walls do not determine the pose, or too few returns lie on what the reference shows.
ScanComparison compare_scans(std::span<const PolarScan> scans, const PolarScan& reference,
                             const CompareOptions& options = {});

/// How much the same scene's returns change from scan to scan.
struct ScanRepeatability {
  int changes = 0;              ///< Columns compared.
  double mean_change_px = 0.0;  ///< Of the position in the image, across the stripe.
  double mean_change_m = 0.0;   ///< Of the range: the paper's Delta_d_t.
  double mean_pixel_m = 0.0;    ///< What one pixel is in range: its Delta_d_p.
  double ratio = 0.0;           ///< mean_change_m / mean_pixel_m; the paper finds about .3.
};

/// Compares each scan with the next (of the same laser and field), column by column. Of normal
/// errors the mean change is 2 / sqrt(pi) sigma.
/// @throws Error{kBadValue} where no column is good in two scans that follow each other,
/// or its returns do not say their pixels.
ScanRepeatability repeatability(std::span<const PolarScan> scans);

}  // namespace striper
