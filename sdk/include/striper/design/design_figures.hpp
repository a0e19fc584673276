// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>
#include <vector>

#include <striper/design/striper_design.hpp>
#include <striper/geometry/triangulator.hpp>

namespace striper {

/// What a design reaches at one place. NaN where the place is not seen or not lit.
struct RangeFigures {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  double range_m = kNone;
  double step_out_m =
      kNone;  ///< To the range one pixel of the image farther out; inf at a horizon.
  double step_derivative_m = kNone;  ///< Of one pixel of the image, by the derivative.
  double signal_dn = kNone;  ///< Height of the stripe's Gaussian before the pixels integrate it.
  double background_dn = kNone;  ///< Of the sun on the same surface, above the black level.
  double signal_to_background =
      kNone;                    ///< Peak of the laser's light over the sun's: the paper's S/N.
  double snr = kNone;           ///< Signal over the noise of a pixel beside the stripe.
  double width_px = kNone;      ///< The stripe's Gaussian sigma, sensor pixels.
  double row_sigma_px = kNone;  ///< Predicted error across the stripe, sensor pixels.
  double sigma_m = kNone;       ///< Predicted one-sigma error of the range.
  double detection = kNone;     ///< Probability that the stripe is found.
  bool is_clipped = false;      ///< Whether its middle is brighter than the numbers reach.
};

/// One of the paper's ten requirements and how a design stands to it.
struct Requirement {
  int number = 0;
  std::string wanted;
  std::string reached;
  enum class Standing { kMet, kNotMet, kNotComputed } standing = Standing::kNotComputed;
};

/// The numbers of a striper before its parts are bought.
///
/// Geometry is exact, through the design's lens (`Triangulator`). Light is a budget in closed form:
/// fluence of the laser plane on a surface that faces the laser, Lambert, lens, filter, photons,
/// DN. The error is the Cramer-Rao bound of a Gaussian stripe over pixels (`crlb_sigma_px`), which
/// the methods `fast` and `refined` reach within 4 %; the detection that of a matched filter over a
/// scan line of the image. Not in it: speckle, the surface's texture, the calibration's error.
/// Immutable; thread-safe; some 30 us a range.
class DesignFigures {
 public:
  /// @throws Error{kBadValue} as `StriperDesign::validate`, and where the model has no such laser.
  explicit DesignFigures(StriperDesign design);

  const StriperDesign& design() const noexcept { return design_; }

  /// @param bearing_rad in the scan frame; 0 is straight ahead.
  RangeFigures at(double range_m, double bearing_rad = 0.0) const;

  /// The angle of one pixel along the stripe, in the middle of the image.
  double angular_resolution_rad() const;

  /// From the first to the last bearing that the image shows and the fan lights at a range.
  double coverage_rad(double range_m) const;

  /// The nearest and farthest range in the image straight ahead; the far one is infinite where
  /// the image reaches the horizon, both are NaN where nothing between 1 cm and 1 km is seen.
  double near_m() const noexcept { return near_m_; }
  double far_m() const noexcept { return far_m_; }

  /// Where the stripe stops being found with the design's detection at its false alarms; NaN where
  /// it is found nowhere.
  double max_range_m() const;

  /// The sun over the mean light of the laser without filter or shutter: the paper's 8e4.
  /// @return laser over sun.
  double laser_to_sun(double range_m) const;

  /// By how much the shutter alone lowers the sun: 1 / (rate x shutter).
  double shutter_factor() const noexcept;

  /// By how much the filter does, `DesignSun`: an input (the paper's 40).
  double filter_factor() const noexcept;

  /// Scans a second: fields and dark exposures counted.
  double scan_rate_hz() const noexcept;

  /// The ten requirements of Mertz et al. 2002, in order.
  std::vector<Requirement> requirements() const;

 private:
  struct Light;
  bool is_seen(double range_m, double bearing_rad) const;
  bool is_lit(const Eigen::Vector3d& p_cam) const;
  double edge_bearing_rad(double range_m, double sign) const;
  double laser_fluence_j_m2(double distance_m) const;
  double thickness_sigma_m(double distance_m) const;
  Light light_at(const Eigen::Vector3d& p_cam, const Eigen::Vector2d& pixel) const;
  Light light_by_optics(const Eigen::Vector3d& p_cam, const Eigen::Vector2d& pixel) const;
  Light light_by_look(const Eigen::Vector3d& p_cam, double range_m) const;
  void add_steps(const Eigen::Vector2d& pixel, RangeFigures& figures) const;
  void add_errors(const Eigen::Vector2d& pixel, RangeFigures& figures) const;
  int line_pitch() const noexcept;

  StriperDesign design_;
  Triangulator triangulator_;
  double threshold_sigmas_;  // What noise in a scan line of the image exceeds with `false_alarm`.
  double near_m_ = RangeFigures::kNone;
  double far_m_ = RangeFigures::kNone;
};

}  // namespace striper
