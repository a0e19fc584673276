// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include <striper/profile/segments.hpp>
#include <striper/scan/polar_scan.hpp>

namespace striper {

/// What smoothing did to one return.
struct SmoothedReturn {
  double sigma_m = Return::kNone;  ///< One sigma of the new range; NaN where it was left as it was.
  /// How far around the errors of neighbouring returns are alike, radians of bearing: these are no
  /// independent measurements any more. On a straight piece the whole of it.
  double correlation_rad = 0.0;
};

/// Re-estimates every return of a scan from its own piece and neighbours (`--smooth line`).
///
/// On a straight piece a return becomes the piece's line, on a circular one its circle. Where a
/// straight piece may be bent, by less than a cut is worth, it is the mean of both, each as far as
/// it is probable, and the sigma has how far they differ. Pieces that meet may together be one
/// curved surface: then it is a Gaussian process whose second derivative is white noise about a
/// straight line (in 1/range, q'' + q = w, a Kalman filter and smoother with two states; Kohn &
/// Ansley 1987 for its likelihood), of that strength which the returns make most likely; where its
/// residuals say that it is known better or worse, the sigmas follow; where one of its joints is
/// none of a curve it breaks off there. Never across a step, nor across a corner: a return that may
/// be on either side of one has the mean of both surfaces, as far as each is probable. In rough
/// pieces the scatter is the surface's own: these stay as they are.
///
/// Of each return bearing, near, far, row sigma and pixel stay; range_m, x_m, y_m and sigma_m
/// change. sigma_m is then true for one return; means over neighbours do not get better with it.
/// Under 60 us for 640 returns besides the segmentation, curved ones too; no allocation after the
/// first scans. Not thread-safe.
class Smoother {
 public:
  /// @throws Error{kBadValue} where the options are not valid.
  explicit Smoother(const SegmentOptions& options = {});
  Smoother(Smoother&&) noexcept;
  Smoother& operator=(Smoother&&) noexcept;
  ~Smoother();

  /// Cuts the scan into pieces and smooths it. Its outliers get the status kOutlier.
  void smooth(PolarScan& scan);

  /// One per return of the last scan; valid until the next.
  const std::vector<SmoothedReturn>& returns() const noexcept;
  const Segmentation& segmentation() const noexcept;  ///< That of the last `smooth(scan)`.

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
