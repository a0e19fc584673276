// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <striper/detect/curb_finding.hpp>
#include <striper/model/striper_model.hpp>
#include <striper/profile/segment_options.hpp>
#include <striper/scan/polar_scan.hpp>

namespace striper {

/// How curbs are told from what is none.
struct CurbOptions {
  /// The direction in the scan frame that points up, within 20 degrees; without it the normal of
  /// the nearest straight piece, towards the sensor, is up.
  std::optional<double> up_rad;
  /// Lower is no curb: half of the lowest that vehicles and feet take note of (5 cm).
  double min_height_m = 0.03;
  /// Higher is a wall or a vehicle: kerbs of bus stops end at .25 m.
  double max_height_m = 0.30;
  SegmentOptions segments;

  /// @throws Error{kBadValue} naming the field, the value and what was expected.
  void validate() const;
};

/// The road and what is at its ends, by one scan.
struct CurbView {
  bool has_road = false;
  ScanLine road;                    ///< The piece nearest to the sensor.
  Eigen::Vector2d along{1.0, 0.0};  ///< Along the road's line, where lateral grows.
  double from_m = 0.0;              ///< Lateral between which
  double to_m = 0.0;                ///< ground without an end is seen.
  /// Of one side, then of the other; outwards on each: what stands on the road, and the road's end.
  std::vector<CurbFinding> findings;

  /// From the road over a curb there: away from the middle of the ground that is seen.
  Eigen::Vector2d outward_at(double lateral_m) const noexcept {
    return 2.0 * lateral_m > from_m + to_m ? along : Eigen::Vector2d(-along);
  }
};

/// Looks for curbs in scans whose plane cuts the ground.
///
/// The road is the smooth piece next below the sensor and what goes on from it; the first surface
/// that leaves it is fitted, with the returns given anew to road, face and top by the vertices, and
/// weighed: what is there at all by the likelihood against a road that goes on, what it is by
/// the probability that height and slope are a curb's. Behind what stands on the road it is looked
/// for on, where the road is seen again.
/// Gutters, crowns and humps are road. Tilt is not asked for: all is beside the road's own line.
///
/// A scan of 640 returns costs the segmentation (200 us), 20 us and, with a calibration's
/// covariance, 60 us a curb; no allocation after the first scans. Not thread-safe.
class CurbFinder {
 public:
  /// @throws Error{kBadValue} where the options are not valid.
  /// @param model of the scans: along which line noise moves returns, and what the calibration's
  ///        error does to place and height. Null: what the scans' own frames say.
  explicit CurbFinder(const CurbOptions& options = {},
                      std::shared_ptr<const StriperModel> model = nullptr);
  CurbFinder(CurbFinder&&) noexcept;
  CurbFinder& operator=(CurbFinder&&) noexcept;
  ~CurbFinder();

  /// @return what is seen, valid until the next call.
  const CurbView& find(const PolarScan& scan);

  const CurbOptions& options() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
