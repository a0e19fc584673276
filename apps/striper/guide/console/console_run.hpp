// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <striper/core/event.hpp>
#include <striper/guidance/guidance.hpp>

#include "guide/run_inputs.hpp"

namespace striper::program {

/// The truck as the console has it: a run that goes on with a clock, its odometer, the last sweep
/// of each beam, and guidance over them while it is asked for.
class ConsoleRun : private GuidanceListener {
 public:
  /// @throws Error as `RunInputs` does.
  ConsoleRun(const std::filesystem::path& directory, const GuidanceConfig& config,
             const EventPort& events);

  /// Goes on by so much of the run's own time. @return false once the run is at its end.
  bool go_on(double seconds);

  /// Guidance hears of it: guns off, the safe voltage.
  void set_laser(bool is_on);
  bool is_laser_on() const noexcept { return is_laser_on_; }

  /// Begins guidance anew, by other parameters; window and points stay those of the run.
  void start_guidance(const GuidanceConfig& config);
  void stop_guidance();
  bool is_guiding() const noexcept { return guidance_.has_value(); }

  std::int64_t counts() const noexcept { return odometer_.total_counts(); }
  std::int64_t shown_counts() const noexcept { return shown_counts_; }  ///< As the counter has it.
  Motion motion() const { return odometer_.latest(); }
  /// The last of a beam; nothing before the first, or with the laser off.
  const BeamSweep* last_sweep(std::size_t beam) const noexcept;
  const LateralLine* lateral() const noexcept { return lateral_ ? &*lateral_ : nullptr; }
  bool is_gun_on(std::size_t gun) const noexcept { return gun < guns_.size() && guns_[gun]; }
  std::optional<GuidanceTotals> totals() const;
  /// The last fault that was said and not yet asked for.
  std::optional<FaultLine> take_fault();

  // Of RunInputs::give_next.
  void take(const OdometerReading& reading);
  void take(const TruckState& state);
  void take(const BeamSweep& sweep);

 private:
  void lateral(const LateralLine& line) override { lateral_ = line; }
  void switch_gun(std::size_t gun, bool is_on, double time_s) override;
  void fault(const FaultLine& line) override { fault_ = line; }

  GuidanceConfig recorded_;
  RunInputs inputs_;
  Odometer odometer_;
  bool has_odometer_ = false;
  std::int64_t shown_counts_ = 0;
  std::vector<std::optional<BeamSweep>> sweeps_;
  std::optional<Guidance> guidance_;
  std::optional<LateralLine> lateral_;
  std::vector<bool> guns_;
  std::optional<FaultLine> fault_;
  bool is_laser_on_ = true;
  double now_s_ = 0.0;
  double until_s_ = 0.0;
  bool has_begun_ = false;
};

}  // namespace striper::program
