// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include <striper/detect/curb_detector.hpp>
#include <striper/motion/motion.hpp>
#include <striper/scan/polar_scan.hpp>

namespace striper {

/// How returns become objects and objects become tracks.
struct ObjectOptions {
  /// Two neighbours are of one object where they are nearer to each other than five sigma and
  /// what a surface at a slant of ten degrees leaves between two rays, but never more than this.
  double max_gap_m = 0.3;
  int min_returns = 3;  ///< Fewer are no object: a single one is an outlier at times.
  /// How far a face is from straight, one sigma, beyond what its returns' own sigmas say: clothes,
  /// panels. Common to all returns of a face, so never averaged down.
  double roughness_m = 0.0;
  /// White acceleration while nothing shows that the velocity changes, one sigma over a scan's
  /// time. So small that the error bars of what moves evenly are true from the third scan on.
  double acceleration_m_s2 = 0.1;
  /// Where an object is more than two sigma from where it should be, that acceleration is taken
  /// which explains it, up to this: what tyres on a dry road brake with.
  double max_acceleration_m_s2 = 10.0;
  /// Whether each track learns from its innovations by how much faces are rougher and velocities
  /// less even than the options say. Without it the options are all there is.
  bool learns = true;
  /// Two sigma of what an object's velocity is before it was seen twice: 108 km/h.
  double max_speed_m_s = 30.0;
  /// What stands less high over the road, or over the pavement beyond a curb, is ground.
  double ground_clearance_m = 0.1;
  /// The way ahead in the scan frame, for the own motion.
  double forward_rad = 0.0;
  /// The scan's origin in the vehicle (x ahead, y left) from the point whose way the odometer
  /// counts (the rear axle's middle), metres.
  Eigen::Vector2d mount_m{0.0, 0.0};

  /// @throws Error{kBadValue} naming the field, the value and what was expected.
  void validate() const;
};

/// Where an object is, as seen from the road.
enum class ObjectZone { kUnknown, kRoad, kBehindCurb };

/// `unknown`, `road`, `behind_curb`. Static storage.
std::string_view to_string(ObjectZone zone) noexcept;

/// Where the road ends: scan frame.
struct CurbEdge {
  Eigen::Vector2d foot_m{0.0, 0.0};
  Eigen::Vector2d outward{1.0, 0.0};  ///< Unit vector, from the road over the curb.
  double sigma_m = 0.0;               ///< Of the foot along `outward`.
};

/// One object at one scan; scan frame. NaN where it is not known.
struct ObjectTrack {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  std::uint64_t id = 0;  ///< From 1; never used again.
  bool is_seen = false;  ///< In this scan; else all is predicted from the last one that saw it.
  int hits = 0;          ///< Scans that saw it.
  int scans = 0;         ///< Scans since the first, that one included.

  Eigen::Vector2d position_m{kUnknown, kUnknown};  ///< Its closest point.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Constant(kUnknown);
  double width_m = kUnknown;  ///< Of what is visible, from end to end.

  /// Over ground where there is motion, else relative to the sensor. Where only one direction is
  /// observed, the component along that one.
  Eigen::Vector2d velocity_m_s{kUnknown, kUnknown};
  double sigma_v_m_s = kUnknown;     ///< Along `observable_rad`.
  double observable_rad = kUnknown;  ///< The direction in which the velocity is known best.
  bool is_fully_observed = false;    ///< Both ends of it are seen: the other direction is, too.

  double closing_m_s = kUnknown;  ///< At which its distance shrinks: always relative.
  double sigma_closing_m_s = kUnknown;
  /// Distance over closing speed, with 95 % (Fieller 1954): high is infinite where it may not close
  /// at all; all are NaN where it certainly does not.
  double time_to_contact_s = kUnknown;
  double ttc_low_s = kUnknown;
  double ttc_high_s = kUnknown;

  ObjectZone zone = ObjectZone::kUnknown;
  double confidence = 0.0;  ///< Probability that it exists.
};

/// Follows what stands or moves in the scan plane, with the error bars of position, velocity and
/// time to contact.
///
/// A flash of a microsecond freezes the whole stripe (28 um at 100 km/h): all returns of a scan are
/// of one time, `PolarScan::time`. There is no skew within a scan as rotating scanners have it, and
/// nothing here takes any out.
///
/// Returns are grouped by their gaps; the face round the closest return is fitted by a line in
/// 1/range. Along that face's normal motion is always observed; along the face only where both ends
/// of the object are seen against something farther, for a wall looks alike wherever it is moved.
/// What is tracked is the middle between the ends, on that face, not the centroid, which moves
/// with what happens to be visible. A constant-velocity Kalman filter for each (position, velocity;
/// white acceleration, which an innovation beyond two sigma raises to what explains it: Bar-Shalom,
/// Li & Kirubarajan 2001, 11.2, in one step), the velocity known from the second scan on;
/// association by Mahalanobis distance, one to one, the most likely pair first. Existence by Bayes:
/// a hit raises it, a look at where it should be lowers it, a nearer return that hides it leaves
/// it.
///
/// Own motion is taken out by the chord between two scans. One scan frame: an instance for each
/// laser plane. Below 1 ms a scan of 640 returns; no allocation after the first scans. Not
/// thread-safe.
class ObjectTracker {
 public:
  /// @throws Error{kBadValue} where the options are not valid.
  explicit ObjectTracker(const ObjectOptions& options = {});
  ObjectTracker(ObjectTracker&&) noexcept;
  ObjectTracker& operator=(ObjectTracker&&) noexcept;
  ~ObjectTracker();

  /// Says where the ground is and where it ends from now on: its returns are no objects, and its
  /// curbs of kind up divide the zones. Null forgets both.
  void set_ground(const CurbView* view) noexcept;
  /// The same of a street that is tracked: its ground as the last scan shows it; on either side the
  /// curb that all scans show, where it is one with 0.9 or more, else that of the last scan. So one
  /// that is hidden by what stands before it still divides the zones, for 5 m of way. Once a scan,
  /// before `update`.
  void set_street(const CurbDetector& street) noexcept;
  /// Says where the road ends from now on: at most two are taken.
  void set_curbs(std::span<const CurbEdge> curbs) noexcept;

  /// Takes the next scan, in the order of time; one that goes back, or comes after a second
  /// without, begins anew.
  /// @param motion of the vehicle at the scan's time. None, or one without distance: all is
  ///        relative. Tracks begin anew where it comes or goes.
  /// @return what is there, seen or not, the longest known first; valid until the next call.
  std::span<const ObjectTrack> update(const PolarScan& scan,
                                      const std::optional<Motion>& motion = std::nullopt);

  const ObjectOptions& options() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
