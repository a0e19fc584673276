// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include <striper/detect/curb_finder.hpp>
#include <striper/motion/motion.hpp>
#include <striper/scan/polar_scan.hpp>

namespace striper {

/// How curbs are tracked along the way.
struct CurbDetectorOptions {
  CurbOptions curb;  ///< Of one scan.
  /// How fast a curb's distance changes before it was seen to, one sigma: metres a metre of way.
  /// 0.2 is 11 degrees between the way and the curb.
  double slope = 0.2;
  /// By how much that changes over the root of a metre, one sigma: 0.05 is a bend of 20 m radius.
  double bend = 0.05;
  /// How far a curb's face is from straight, one sigma, metres: stones that were set by hand.
  double straightness_m = 0.002;
  /// By how much its height changes over the root of a metre of way, one sigma, metres.
  double height_change_m = 0.005;
  /// Mean length along the way of what stands on the road and is no curb, metres: boxes, wheels,
  /// people.
  double object_length_m = 0.5;
  /// Taken for the vehicle's speed where there is no motion, m/s: it is then tracked as well as
  /// that is true.
  double speed_m_s = 5.0;

  /// @throws Error{kBadValue} naming the field, the value and what was expected.
  void validate() const;
};

/// How a curb stands at one scan.
enum class CurbState {
  kNew,      ///< Seen in fewer than three scans.
  kTracked,  ///< Seen in this scan.
  kHidden,   ///< Not seen in this one: all is predicted from the last one that saw it.
};

/// `new`, `tracked`, `hidden`. Static storage.
std::string_view to_string(CurbState state) noexcept;

/// One curb at one scan, as all scans so far say; definitions of foot, edge and height as in
/// CurbFinding. NaN where it is not known.
struct CurbTrack {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  std::uint64_t id = 0;  ///< From 1; never used again.
  CurbKind kind = CurbKind::kUp;
  CurbState state = CurbState::kNew;
  Eigen::Vector2d foot_m{kUnknown, kUnknown};  ///< Scan frame.
  Eigen::Vector2d top_m{kUnknown, kUnknown};   ///< The edge.
  Eigen::Vector2d outward{1.0, 0.0};           ///< Unit vector along the road, over the curb.
  double lateral_m = kUnknown;
  double sigma_lateral_m = kUnknown;
  double height_m = kUnknown;
  double sigma_height_m = kUnknown;
  /// Of the calibration, common to all scans: travel does not make them less. Those of the last
  /// scan that saw it; NaN where the calibration has no covariance.
  double sigma_cal_lateral_m = kUnknown;
  double sigma_cal_height_m = kUnknown;
  double slope = kUnknown;  ///< Lateral metres a metre of way.
  double sigma_slope = kUnknown;
  double way_m = 0.0;       ///< From the scan that saw it first.
  int hits = 0;             ///< Scans that saw it.
  double confidence = 0.0;  ///< Probability that it is a curb, up or down.
};

/// Follows curbs along the way of a vehicle whose scan plane cuts the road.
///
/// Each track is a Kalman filter of lateral distance and slope (white change of slope, so that
/// bends are tracked) and one of height. A finding belongs to a track where it is within four
/// sigma of what the track predicts.
///
/// Whether it is a curb is weighed against two others. What a single scan took for one by chance is
/// not there in the next. What stands on the road ends: of mean length L its probability of being
/// there still falls by exp(-way / L), which a curb's does not. So boxes, wheels and people die
/// within a metre or two and curbs live. A hit raises the curb, a clear look at where it should be
/// lowers it, and what hides it, or a road that is not seen, leaves it as it was, but for the error
/// bar, which grows. Kind is a fading mean over half a metre of way of what single scans say.
///
/// Tilt is not asked for: all is beside the road's own line. The vehicle's yaw makes the slope less
/// sure by as much as it turned, since what it does to the distance depends on where the scan plane
/// looks. Calibration errors are common to all scans and have error bars of their own.
///
/// The cost is that of CurbFinder; no allocation after the first scans. One scan frame: an instance
/// for each laser plane. Not thread-safe.
class CurbDetector {
 public:
  /// @throws Error{kBadValue} where the options are not valid.
  /// @param model as for CurbFinder.
  explicit CurbDetector(const CurbDetectorOptions& options = {},
                        std::shared_ptr<const StriperModel> model = nullptr);
  CurbDetector(CurbDetector&&) noexcept;
  CurbDetector& operator=(CurbDetector&&) noexcept;
  ~CurbDetector();

  /// Takes the next scan, in the order of time; one that goes back, or comes after a second
  /// without, begins anew.
  /// @param motion of the vehicle at the scan's time; without it `speed_m_s` is taken for its
  ///        speed.
  /// @return curbs and ramps, the longest known first; valid until the next call.
  std::span<const CurbTrack> update(const PolarScan& scan,
                                    const std::optional<Motion>& motion = std::nullopt);

  /// What the last `update` returned.
  std::span<const CurbTrack> tracks() const noexcept;
  /// What the last scan showed by itself.
  const CurbView& view() const noexcept;

  const CurbDetectorOptions& options() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
