// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <striper/profile/segment_options.hpp>
#include <striper/scan/polar_scan.hpp>

namespace striper {

/// A straight line of the scan plane: cos(angle) x + sin(angle) y = distance, scan frame.
struct ScanLine {
  double angle_rad = 0.0;   ///< Direction of the normal that points away from the origin.
  double distance_m = 0.0;  ///< Of the line from the origin, at least 0.
  Eigen::Matrix2d covariance =
      Eigen::Matrix2d::Zero();  ///< Of angle_rad and distance_m: random error alone.

  Eigen::Vector2d normal() const;
  /// Along the line, counter-clockwise from the normal.
  Eigen::Vector2d direction() const;
  /// How far a point lies beyond the line, seen from the origin.
  double offset_m(const Eigen::Vector2d& p_scan) const;
  /// The variance of `offset_m`, the point taken as exact.
  double offset_variance_m2(const Eigen::Vector2d& p_scan) const;
};

/// A circle of the scan plane.
struct ScanCircle {
  Eigen::Vector2d centre_m{0.0, 0.0};  ///< Scan frame.
  double radius_m = 0.0;
  bool is_hollow = false;  ///< Its inside is seen.
  Eigen::Matrix3d covariance =
      Eigen::Matrix3d::Zero();  ///< Of centre and radius: random error alone.
};

/// A run of returns on one straight line or circle. Doubtful and missing returns in between belong
/// to no piece.
struct Piece {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  bool is_rough = false;  ///< Scatters by more than noise and texture; `scale` is then its own.

  std::size_t first = 0;  ///< Of the scan's returns.
  std::size_t last = 0;   ///< Included.
  int points = 0;

  ScanLine line;                     ///< Of a circular piece the best straight one.
  std::optional<ScanCircle> circle;  ///< Of a circular piece (SegmentOptions::find_circles).

  /// Where the surface begins and ends, scan frame: at a corner the corner; at an edge half a
  /// column's spacing beyond the outermost return that is at least half as bright as the surface,
  /// for there it is somewhere in between, and half a spacing more for each of up to two doubtful
  /// returns as bright that follow;
  /// of a circular piece where its outermost returns are on the circle, which turns away there and
  /// may go on unseen for several columns.
  Eigen::Vector2d begin_m{kNone, kNone};
  Eigen::Vector2d end_m{kNone, kNone};
  double sigma_begin_m = kNone;  ///< Along the line: spacing / sqrt(12) at an edge with no
                                 ///< doubtful return beside it; NaN of circles.
  double sigma_end_m = kNone;
  bool is_begin_seen =
      false;  ///< False where the scan itself begins or ends: the surface may go on.
  bool is_end_seen = false;

  double chi2 = kNone;  ///< Of the residuals over noise and texture.
  int dof = 0;
  double scale = 1.0;       ///< Scatter over noise and texture; 1 unless rough.
  double evidence = kNone;  ///< By how much chi2 grows when it is joined to the neighbour that it
                            ///< suits better; NaN where there is none.
};

enum class JointKind {
  kCorner,  ///< The surfaces meet.
  kStep     ///< One ends before the other: an edge in front of something. All joints of rough
            ///< pieces, which meet nothing exactly, and of circular ones.
};

/// Between piece i and piece i + 1.
struct Joint {
  JointKind kind = JointKind::kStep;
  Eigen::Vector2d corner_m{Piece::kNone, Piece::kNone};  ///< Of a corner, scan frame.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Constant(Piece::kNone);  ///< Random error alone.
  double evidence = Piece::kNone;  ///< By how much chi2 grows when both pieces are one.
};

/// A scan as pieces, in the order of its returns.
struct Segmentation {
  std::vector<Piece> pieces;
  std::vector<Joint> joints;          ///< One fewer than pieces.
  std::vector<std::size_t> outliers;  ///< Returns that were ok and are on nothing, ascending.
  double texture_m = 0.0;             ///< One-sigma roughness of the surfaces, across them.
  double penalty = 0.0;               ///< What a piece had to gain.
};

/// Finds the straight pieces of scans by their likelihood under each return's
/// own sigma.
///
/// In 1/range a straight line is linear and a striper's noise Gaussian, so a piece's chi2 comes
/// from six sums; the best of all ways to cut is found exactly (src/profile/partition.hpp). Speckle
/// is left out before. Where circles are looked for, straight pieces are joined to them
/// (src/profile/circle_search.hpp). Calibration errors move all returns together and are not in any
/// figure here. Sigmas have to be right: returns without one are not used.
///
/// About 100 us for 640 returns on a few surfaces, 250 us on waves; no
/// allocation after the first scans. Not thread-safe.
class Segmenter {
 public:
  /// @throws Error{kBadValue} where the options are not valid.
  explicit Segmenter(const SegmentOptions& options = {});
  Segmenter(Segmenter&&) noexcept;
  Segmenter& operator=(Segmenter&&) noexcept;
  ~Segmenter();

  void segment(const PolarScan& scan, Segmentation& segmentation);

  const SegmentOptions& options() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Gives the segmentation's outliers the status kOutlier.
void mark_outliers(const Segmentation& segmentation, PolarScan& scan);

}  // namespace striper
