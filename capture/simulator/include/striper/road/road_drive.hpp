// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include <striper/guidance/beam_alignment.hpp>
#include <striper/guidance/beam_sweep.hpp>
#include <striper/guidance/guidance_csv.hpp>
#include <striper/motion/odometer_csv.hpp>
#include <striper/road/road.hpp>

namespace striper {

/// A truck on a simulated road: what its beams and its odometer say, in the order of time, and what
/// is true.
///
/// Each sample is met at its own time and place; a spot's light is spread evenly over its size.
/// Wear, texture and noise depend on the seed alone. Sweeps of beams come together, as the report's
/// converter took them. Not thread-safe. About 4 us a call of `next`, sweeps of 142 samples among
/// them.
class RoadDrive {
 public:
  explicit RoadDrive(const Road& road);  ///< @throws Error as `Road::validate` does.
  RoadDrive(RoadDrive&&) noexcept;
  RoadDrive& operator=(RoadDrive&&) noexcept;
  ~RoadDrive();

  /// What comes next: one of the two is filled in. @return false at the end of the road.
  enum class Next { kSweep, kOdometer, kEnd };
  Next next(BeamSweep& sweep, OdometerReading& reading);

  double duration_s() const noexcept;
  double way_m() const noexcept;  ///< That the truck goes, by its odometer.
  double time_at(double distance_m) const noexcept;
  double distance_at(double time_s) const noexcept;

  /// What is true where the truck has gone so far.
  RoadTruth truth_at(double distance_m) const noexcept;
  /// Of line `line` at a place before the truck there: lateral position in the truck's frame.
  double lateral_at(double distance_m, double x_m, int line = 0) const noexcept;
  /// Whether paint of a line is there, abreast of the truck's reference.
  bool is_painted(double distance_m, int line) const noexcept;

  /// What the tape measure says, in the order of time; empty where the road has none.
  std::vector<TapeReading> tape_readings() const;

  /// The gun paints here: fresh paint of the stripe's width, so far to the left of the truck's
  /// axis, which beams behind see.
  void paint(double from_m, double to_m, double lateral_m);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
