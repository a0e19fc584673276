// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace striper {

struct PaintGunOptions {
  double x_m = 0.0;           ///< Forward of the reference that distances are of.
  double on_delay_s = 0.0;    ///< From the signal until paint comes out,
  double off_delay_s = 0.0;   ///< and until no more does.
  double on_advance_m = 0.0;  ///< So much earlier than that, by distance.
  double off_advance_m = 0.0;
  double end_extension_m = 0.0;  ///< Each end of a dash is painted longer; the report: 2 in.
  double dash_min_m = 0.0;       ///< What is shorter is not painted.
  double gap_min_m = 0.0;        ///< What is shorter is painted over, unless the gun is past it.
  std::size_t dashes = 64;       ///< Between beam and gun at once, at most.

  /// @throws Error{kBadValue} naming field, value and bound.
  void validate() const;
};

/// Switches a paint gun so that its paint lies on the dashes that beams ahead of it have seen.
///
/// Dashes wait in a queue by their places on the road, several at once. A dash opens the gun where
/// it begins and closes it where it ends, each earlier by what the valve takes at the present speed
/// and by its advance. Only paint that has been seen is painted: where a dash's end is not known
/// yet the gun closes at the last place that was seen painted.
///
/// No allocation after construction. Not thread-safe.
/// Source: section 2.3, equation (15), of Advanced Retro Technology, *Automated Paint Restriping
/// Recognition and Guidance System*, UCD-ARR-91-11-01-01, 1991; its single variable in place of the
/// queue holds one end at a time, and delays and extension are what it leaves to its second phase.
class PaintGun {
 public:
  explicit PaintGun(const PaintGunOptions& options);  ///< @throws Error as `validate` does.

  /// What the beams see, in the order of the road; places are metres along it.
  /// @return false, and the dash is not painted, where the queue is full or the place is no number
  bool begin_dash(double at_m) noexcept;
  void see_paint(double at_m) noexcept;  ///< The newest dash, not ended yet, reaches so far.
  void end_dash(double at_m) noexcept;

  /// What another beam sees later of dashes that are known: an end within `near_m` of a place is
  /// where it says instead. @return whether there was such an end, not acted upon yet
  bool move_begin(double at_m, double near_m, double to_m) noexcept;
  bool move_end(double at_m, double near_m, double to_m) noexcept;
  /// Adds a whole dash that the first beam has missed, in its place.
  bool add_dash(double from_m, double to_m) noexcept;

  /// Decides the gun's signal. It is late by up to the travel between two calls: call it at each
  /// odometer reading, not only at each scan.
  /// @param distance_m where the reference is on the road
  /// @param speed_m_s forwards
  /// @return whether the gun is to be on; off where either is no number
  bool update(double distance_m, double speed_m_s) noexcept;

  /// Forgets all dashes and closes: for faults.
  void stop() noexcept;

  std::size_t waiting() const noexcept { return size_; }
  std::uint64_t lost() const noexcept { return lost_; }  ///< Dashes that found the queue full.

 private:
  struct Dash {
    double from_m = 0.0;
    double to_m = 0.0;  // Seen painted up to here.
    bool is_ended = false;
  };
  Dash& dash(std::size_t index) noexcept { return ring_[(oldest_ + index) % ring_.size()]; }
  bool wants_on(const Dash& dash, double on_m, double off_m) const noexcept;
  void drop_oldest() noexcept;

  PaintGunOptions options_;
  std::vector<Dash> ring_;
  std::size_t oldest_ = 0;
  std::size_t size_ = 0;
  std::uint64_t lost_ = 0;
  bool is_on_ = false;
};

}  // namespace striper
