// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <striper/guidance/beam_sweep.hpp>
#include <striper/guidance/guidance_config.hpp>
#include <striper/guidance/guidance_csv.hpp>
#include <striper/motion/odometer.hpp>

namespace striper {

/// Hears what guidance decides, at once and in the order of time. What its functions throw comes
/// out of the call that they were told in; that guidance is then of no further use.
class GuidanceListener {
 public:
  virtual ~GuidanceListener() = default;
  virtual void lateral(const LateralLine& /*line*/) {}
  /// A gun's signal changes now.
  virtual void switch_gun(std::size_t /*gun*/, bool /*is_on*/, double /*time_s*/) {}
  virtual void gun(const GunLine& /*line*/) {}  ///< A stretch of one signal has ended.
  virtual void seen(const SeenLine& /*line*/) {}
  virtual void fault(const FaultLine& /*line*/) {}
  virtual void switch_laser_off(double /*time_s*/) {}
};

/// What a job comes to.
struct GuidanceTotals {
  struct Gun {
    std::string name;
    double on_m = 0.0;
    std::uint64_t dashes = 0;                                  ///< Times it was switched on.
    double dash_m = std::numeric_limits<double>::quiet_NaN();  ///< The pattern found; NaN: none.
    double cycle_m = std::numeric_limits<double>::quiet_NaN();
    double pattern_quality = 0.0;
  };
  std::uint64_t sweeps = 0;
  std::uint64_t unknown_sweeps = 0;  ///< Of beams that the file does not know.
  std::uint64_t scans = 0;
  std::array<std::uint64_t, 4> scans_of_state{};  ///< As PathState.
  double way_m = 0.0;
  double longest_gap_m = 0.0;  ///< Without a sight of the followed line, once it was seen.
  std::vector<Gun> guns;
  std::array<std::uint64_t, kSeenKinds> seen{};  ///< By the first forward beam; lines by all.
  std::array<std::uint64_t, kGuidanceFaults> faults{};
  std::uint64_t dashes_lost = 0;         ///< That did not fit a gun's queue.
  std::uint64_t dashes_not_allowed = 0;  ///< That did not fit a locked pattern.
};

/// Guides a paint truck along a worn stripe: sweeps and odometer readings in, the stripe's lateral
/// position at the gun and the guns' signals out.
///
/// Each beam's sweep is read for paint (`PaintFinder`); what lies where the stripe is predicted is
/// the stripe, all else is told apart and counted. The path is followed by `PathFilter`, or as the
/// 1991 report did it (`ReportPath`). Ends of dashes are those of the forward beams, averaged, by
/// an odometer that is interpolated between its counts and by each sample's own time. Guns open and
/// close by `PaintGun`, on a clock of 0.1 ms between the inputs.
///
/// What goes in must come in the order of time. The same inputs give the same outputs, bit for bit.
/// No allocation after the first sweeps but what listeners do. Not thread-safe. ~20 us a scan of
/// three beams.
/// Source: Advanced Retro Technology, *Automated Paint Restriping Recognition and Guidance System*,
/// UCD-ARR-91-11-01-01, 1991, sections 2.3 to 2.5, and what it leaves to its second phase.
class Guidance {
 public:
  /// @param listener must live as long. @throws Error as `GuidanceConfig::validate` does.
  Guidance(const GuidanceConfig& config, GuidanceListener& listener);
  Guidance(Guidance&&) noexcept;
  Guidance& operator=(Guidance&&) noexcept;
  ~Guidance();

  void take(const OdometerReading& reading);
  /// With an odometer of its own its counts are not looked at.
  void take(const BeamSweep& sweep);
  void take(const TruckState& state);
  /// Lets the clock run on without an input: for guns and for what is silent.
  void go_to(double time_s);
  /// Ends the last stretches of the guns. Nothing may be taken afterwards.
  void finish();

  GuidanceTotals totals() const;
  /// Where the followed line will be at the gun when the truck has gone on by so much, for a drive
  /// that needs time to follow: speed * delay. By the filter; NaN where nothing is known, and of
  /// the report's methods.
  double lateral_after(double way_m) const noexcept;
  const GuidanceConfig& config() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
