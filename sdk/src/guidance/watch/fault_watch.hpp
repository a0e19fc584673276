// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include <striper/guidance/guidance_config.hpp>
#include <striper/guidance/guidance_csv.hpp>

namespace striper::detail {

/// Watches all that goes into guidance, and says what of it is wrong.
///
/// Each fault is on or off; that it went on is told once, with how long after it could be known.
/// What is silent is missed 2 ms after it was due, and a beam that never began a second after the
/// first that did. No allocation after construction.
class FaultWatch {
 public:
  explicit FaultWatch(const GuidanceConfig& config);

  void sweep(std::size_t beam, double time_s, bool is_blind) noexcept;
  void odometer(double time_s, bool is_plausible) noexcept;
  void truck(const TruckState& state) noexcept;
  void time_jumped(double time_s) noexcept;
  void stripe(bool is_missing, double time_s) noexcept;
  void queue(bool is_full, double time_s) noexcept;

  /// What went on by now, one a call.
  std::optional<FaultLine> take(double now_s) noexcept;

  /// What the worst fault that is on does; nothing where there is none or all are only said.
  std::optional<FaultAction> action() const noexcept;
  bool is_on(GuidanceFault fault) const noexcept;
  /// A mirror that stands burns one place.
  bool must_switch_laser_off() const noexcept { return is_on(GuidanceFault::kMirror); }

 private:
  struct State {
    bool is_on = false;
    bool is_told = false;
    double since_s = 0.0;  // From when it could be known.
  };
  // Something that comes again and again.
  struct Rhythm {
    double last_s = std::numeric_limits<double>::quiet_NaN();
    double period_s = 0.0;

    double due_s() const noexcept;
  };
  double due_s(const Rhythm& beam) const noexcept;
  void set(GuidanceFault fault, bool is_on, double since_s) noexcept;
  void look_for_silence(double now_s) noexcept;
  bool is_mirror_wrong(double mirror_hz) noexcept;
  double odometer_due_s() const noexcept;

  std::array<FaultAction, kGuidanceFaults> actions_;
  std::array<State, kGuidanceFaults> states_{};
  std::vector<Rhythm> beams_;
  double first_sweep_s_ = std::numeric_limits<double>::quiet_NaN();  // Of any beam.
  std::vector<char> is_blind_;
  std::vector<char> is_used_;
  Rhythm odometer_;
  double mirror_hz_ = std::numeric_limits<double>::quiet_NaN();  // Once it is steady.
  double last_mirror_hz_ = 0.0;
  int steady_ = 0;  // Readings in a row.
};

}  // namespace striper::detail
