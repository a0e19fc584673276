// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <striper/motion/motion.hpp>
#include <striper/motion/odometer_csv.hpp>

namespace striper {

struct OdometerOptions {
  /// Counts for each metre; below zero where the counter counts down on the way forwards. Must be
  /// given.
  double counts_per_m = std::numeric_limits<double>::quiet_NaN();
  int bits = 32;  ///< The counter's width: 8, 16 or 32. One that never wraps is of any width.
  /// What it moves with at the first reading. Where that is unknown (NaN) the first step is taken
  /// to be the shorter way round the counter, however fast.
  double start_speed_m_s = std::numeric_limits<double>::quiet_NaN();

  /// Faster is a fault: 60 m/s (134 mph) is above what a vehicle on a road does.
  double max_speed_m_s = 60.0;
  /// So is a change of speed above this: tyres on a dry road brake with 10 m/s^2.
  double max_acceleration_m_s2 = 15.0;
  /// No count for so long: it stands. Slower than one count in this time is not seen as motion.
  double stall_s = 0.5;

  double scale_sigma = 0.0;  ///< One-sigma error of `counts_per_m`, relative (tyre, temperature).
  double yaw_rate_sigma_rad_s = std::numeric_limits<double>::quiet_NaN();  ///< Of one reading.
  std::size_t history = 1024;  ///< Readings that `at` looks back over.

  /// @throws Error{kBadValue} naming field, value and bound.
  void validate() const;
};

/// What became of a reading.
enum class OdometerVerdict {
  kTaken,
  kMissed,       ///< Taken; by its time, one or more readings before it are missing.
  kAmbiguous,    ///< Taken; so long after the last one that the counter may have wrapped once more.
  kImplausible,  ///< Not taken: too fast, or too sudden.
  kRestarted,    ///< Several in a row were implausible: the counter was reset; goes on from here.
  kOutOfOrder,   ///< Not taken: its time is not after the last one's, or no number.
};

/// Counts since the first reading.
struct OdometerStatistics {
  std::uint64_t taken = 0;
  std::uint64_t missed = 0;
  std::uint64_t ambiguous = 0;
  std::uint64_t implausible = 0;
  std::uint64_t restarts = 0;
  std::uint64_t out_of_order = 0;
};

/// Turns a wheel's counter into distance and speed.
///
/// The counter is a few bits wide and wraps; which way it went, and how often it wrapped when a
/// reading was missed, is told from the speed before: of all distances that show these counts, the
/// one nearest to what that speed makes of the time. That is certain while, over the time without a
/// reading, the speed cannot change by half a turn of the counter (`kAmbiguous` where it can: the
/// error then has a turn in it). Distance at a reading is exact: whole counts over `counts_per_m`.
/// Between the readings that found a new count it is interpolated, so slow motion is no staircase;
/// what stands for `stall_s` stands from its last count on. Yaw is the integral of the yaw rate by
/// trapezoids; a reading without one goes on with the last.
///
/// No allocation after construction. Not thread-safe.
class Odometer {
 public:
  explicit Odometer(const OdometerOptions& options);  ///< @throws Error as `validate` does.

  /// Takes the next reading, in the order of time.
  OdometerVerdict update(const OdometerReading& reading) noexcept;

  /// The motion at a time: interpolated between counts; beyond the last reading continued with its
  /// speed for `stall_s`, then unknown, as it is before the first one and beyond the history.
  Motion at(double time_s) const noexcept;

  /// At the last reading; all unknown before the first.
  Motion latest() const noexcept { return size_ == 0 ? Motion{} : at(step(0).time_s); }

  /// 1 forwards, -1 backwards, 0 standing (or not known yet).
  int direction() const noexcept;
  bool is_stalled() const noexcept { return size_ > 0 && is_standing(); }

  /// Counts since the first reading, unwrapped.
  std::int64_t total_counts() const noexcept { return size_ == 0 ? 0 : step(0).counts; }
  const OdometerStatistics& statistics() const noexcept { return statistics_; }

 private:
  // A reading that was taken.
  struct Step {
    double time_s = 0.0;
    std::int64_t counts = 0;  // Unwrapped, since the first reading.
    double changed_s = 0.0;   // When a new count was last found.
    bool is_knot = false;     // Found a new count, or stands: between knots is interpolated.
    double yaw_rad = 0.0;
    double yaw_rate_rad_s = 0.0;
    double yaw_variance = 0.0;
    double lost_variance = 0.0;  // Counts squared: of what may have been missed for good.
  };
  // Counts along the path at some time.
  struct Place {
    double counts = 0.0;
    double rate = 0.0;      // A second.
    double window_s = 0.0;  // That the rate is over.
  };

  OdometerVerdict begin(const OdometerReading& reading) noexcept;
  OdometerVerdict reject(const OdometerReading& reading) noexcept;
  OdometerVerdict take(const OdometerReading& reading, std::int64_t delta) noexcept;
  void add(const OdometerReading& reading, std::int64_t delta, double lost_variance) noexcept;
  double sudden_counts(double elapsed_s) const noexcept;
  bool see_gap(double time_s) noexcept;
  void turn(const Step& from, const OdometerReading& reading, Step& to) const noexcept;

  Step& step(std::size_t back) noexcept;
  const Step& step(std::size_t back) const noexcept;
  std::size_t knot_from(std::size_t back) const noexcept;
  bool is_standing() const noexcept;
  std::size_t window_from(std::size_t newer) const noexcept;
  double rate_now() const noexcept;
  Place place_at(std::size_t before, double time_s) const noexcept;
  Place beyond(double time_s) const noexcept;
  Motion describe(std::size_t before, double time_s, const Place& place) const noexcept;

  OdometerOptions options_;
  double half_turn_;  // Counts.
  OdometerStatistics statistics_;
  std::vector<Step> steps_;  // A ring; the newest is step(0).
  std::size_t newest_ = 0;
  std::size_t size_ = 0;
  std::int64_t shown_ = 0;  // By the counter, at the newest step.
  bool is_speed_known_ = false;
  double start_rate_ = 0.0;  // Where it is, before there are two knots.
  double seen_s_ = 0.0;      // The last reading, taken or not.
  double period_s_ = 0.0;    // From reading to reading, usually; 0 while unknown.
  int rejected_in_a_row_ = 0;
  bool has_yaw_ = false;
};

}  // namespace striper
