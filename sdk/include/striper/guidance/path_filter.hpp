// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

namespace striper {

struct PathFilterOptions {
  std::vector<double> beam_x_m;  ///< Where the beams cross the road, forward of the gun; 1 to 8.
  double gap_limit_m = 30.0;     ///< So far without a sight, and it begins anew.
  /// Of the middle of the stripe, from edges that are worn: what is taken until widths have shown
  /// it, one sigma, metres; and over how many metres of road wear is alike.
  double wear_m = 0.006;
  double wear_length_m = 0.076;

  /// @throws Error{kBadValue} naming field, value and bound.
  void validate() const;
};

/// The stripe as one beam sees it once.
struct StripeSight {
  std::size_t beam = 0;
  double lateral_m = 0.0;  ///< Of its middle, to the left of the vehicle's axis.
  double sigma_m = 0.0;    ///< From the sweep's noise alone.
  double width_m = std::numeric_limits<double>::quiet_NaN();
  double since_m = 0.0;  ///< The vehicle's way from the sight to where `advance` has taken it.
};

/// How the stripe lies before the vehicle: y = lateral + heading x + curvature x^2 / 2.
struct StripePath {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  double lateral_m = kUnknown;  ///< At x = 0, the gun's reference.
  double heading_rad = kUnknown;
  double curvature_1_m = kUnknown;          ///< Left is positive.
  double vehicle_curvature_1_m = kUnknown;  ///< Of the vehicle's own way.
  double sigma_lateral_m = kUnknown;
  double sigma_heading_rad = kUnknown;
};

/// What became of a sight.
struct SightVerdict {
  bool is_taken = false;
  double innovation = 0.0;  ///< In sigma: what was seen less what was predicted.
};

/// Follows a worn stripe: a Kalman filter over the way, of the state
/// [lateral, heading, curvature of the stripe, curvature of the stripe less that of the vehicle's
/// way, change of the stripe's curvature], and of the wear that beams see.
///
/// The quadratic of the 1991 report amplifies the beams' noise 1.85 times at the gun and forgets
/// all but the last scan; this weighs what beams saw over the last metres too, as far as the
/// vehicle moves smoothly. How smoothly that is, is found out: nine filters run side by side, from
/// a truck on a straight road to one that swerves on a bend, and weigh by what they predicted.
///
/// Wear of the edges is alike over some centimetres, so that scans that follow closely do not see
/// it anew: an Ornstein-Uhlenbeck process over the road. Nor does the next beam: it sees the very
/// edges that the foremost one saw, copies of whose wear stay in the state until it has passed them
/// (beams within 1.5 m; one further behind counts them as new). How large wear is, is learnt from
/// the stripe's widths, which the vehicle's motion does not change: where both edges wear
/// independently the middle's variance is a quarter of the width's.
///
/// A sight beyond three sigma counts less the further out it is; beyond eight it is not taken,
/// unless nothing else is seen for a metre. In a gap the sigma grows.
///
/// Level road. Without the middle of three beams, or with one beam alone, an offset and a bend look
/// alike without a gyroscope; sigma says so. Where curvature jumps by 1 / 50 ft at once, errors are
/// up to 0.7 in for some metres and sigma is too small. The reference, x = 0, is where the vehicle
/// does not slip sideways: on its rear axle, or near it beside the curves' radius. No allocation
/// after construction. Not thread-safe. About 1 us a sight. Source: section 2.3 of Advanced Retro
/// Technology, *Automated Paint Restriping Recognition and Guidance System*, UCD-ARR-91-11-01-01,
/// 1991, leaves the smoothing to its second phase.
class PathFilter {
 public:
  explicit PathFilter(const PathFilterOptions& options);  ///< @throws Error as `validate` does.
  PathFilter(PathFilter&&) noexcept;
  PathFilter& operator=(PathFilter&&) noexcept;
  ~PathFilter();

  /// Goes on to where the vehicle is, metres along its way. Backwards, all begins anew beyond half
  /// a metre; less is as if it stood.
  void advance(double distance_m) noexcept;

  /// Takes what a beam sees from there.
  SightVerdict see(const StripeSight& sight) noexcept;

  /// The vehicle's own curvature, from a gyroscope: yaw rate over speed.
  void see_curvature(double curvature_1_m, double sigma_1_m) noexcept;

  /// From there; unknown before the first sight and beyond the gap limit.
  StripePath path() const noexcept;
  /// Of the stripe at a place before the vehicle, and its sigma.
  double lateral_at(double x_m) const noexcept;
  double sigma_at(double x_m) const noexcept;
  /// At x = 0 when the vehicle has gone on by so much as it goes now.
  double lateral_after(double way_m) const noexcept;

  double unseen_m() const noexcept;  ///< Way since the last sight that was taken; infinite: none.
  double wear_m() const noexcept;    ///< As learnt: of the middle, one sigma.
  double wear_length_m() const noexcept;
  double beam_x_m(std::size_t beam) const noexcept;  ///< As the options say.

  void reset() noexcept;  ///< Forgets the path, not what was learnt of wear.

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
