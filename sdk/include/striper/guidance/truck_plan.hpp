// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <striper/guidance/guidance_config.hpp>

namespace striper {

/// What a truck is planned for.
struct TruckPlanOptions {
  double speed_m_s = 17.8816;       ///< 40 mph, as the report asks.
  double radius_m = 15.24;          ///< Of the tightest bend; the report: 50 ft.
  double spacing_m = 0.1016;        ///< Between two sweeps of a beam at most; the report: 4 in.
  double step_m = 0.0127;           ///< Between two samples at most; the report: 0.5 in.
  double bend_error_m = 0.0127;     ///< At the gun at most; the report: 0.5 in.
  double acceleration_m_s2 = 2.45;  ///< Sideways, that a truck stands: a quarter of gravity.
  double baseline_m = 0.5;          ///< From a striper's camera to its laser.

  /// @throws Error{kBadValue} naming field, value and bound.
  void validate() const;
};

/// Of one beam that is not off.
struct BeamPlan {
  std::string name;
  double x_m = 0.0;
  double weight = 0.0;       ///< At the gun, of the polynomial through the beams.
  double spacing_m = 0.0;    ///< Between two of its sweeps at the planned speed.
  double speed_m_s = 0.0;    ///< At which sweeps are the asked spacing apart,
  double halved_m_s = 0.0;   ///< and where ends are taken for half way between two sweeps.
  double step_m = 0.0;       ///< The largest between two samples.
  double skew_m = 0.0;       ///< Way during one sweep at the planned speed.
  double slant_m = 0.0;      ///< From scanner to road,
  double grazing_rad = 0.0;  ///< at this angle to it.
  /// Between laser and camera as the road sees them, for a striper's beam; NaN for a retro beam
  /// that looks along its own light.
  double observation_rad = std::numeric_limits<double>::quiet_NaN();
  double bend_m = 0.0;    ///< How far aside the bend takes the stripe there.
  double window_m = 0.0;  ///< Half of the beam's window, on its narrower side.
};

/// What the plan complains of.
enum class PlanWarning {
  kOneBeam,          ///< Tells neither direction nor bend.
  kBendError,        ///< Value: lateral error at the gun in the bend; limit.
  kSpacing,          ///< A forward beam's sweeps are further apart than asked.
  kStep,             ///< A beam's samples are.
  kWindow,           ///< The bend takes the stripe out of a beam's window.
  kAcceleration,     ///< Speed and radius together are more than a truck stands.
  kFeedback,         ///< A beam behind the gun sees its paint; value: by how much errors grow.
  kRetroreflection,  ///< A beam is said to see beads, and its camera is too far off its laser.
  kOdometer,         ///< A count is longer than a quarter of the asked spacing.
  kValve,            ///< A valve needs longer than the way from beam to gun takes.
};
inline constexpr std::size_t kPlanWarnings = 10;
/// `one_beam`, `bend_error`, `spacing`, `step`, `window`, `acceleration`, `feedback`,
/// `retroreflection`, `odometer`, `valve`. Static storage.
std::string_view to_string(PlanWarning warning) noexcept;

struct PlanFinding {
  PlanWarning code = PlanWarning::kOneBeam;
  std::string of;  ///< The beam's or gun's name; empty: the whole truck.
  double value = 0.0;
  double limit = 0.0;
};

/// What keeps the truck from going faster.
struct SpeedLimit {
  std::string by;  ///< `beam NAME`, `bend`, `gun NAME`.
  double speed_m_s = 0.0;
};

struct TruckPlan {
  std::vector<BeamPlan> beams;
  double noise_gain = 0.0;         ///< Noise at the gun over that of one beam.
  double bend_error_m = 0.0;       ///< Of the polynomial at the gun, on the circle.
  double acceleration_m_s2 = 0.0;  ///< Sideways, at the planned speed and radius.
  double speed_in_bend_m_s = 0.0;  ///< That the truck stands on the radius.
  double radius_at_speed_m = 0.0;  ///< That it stands at the speed.
  double count_m = 0.0;            ///< Of the odometer.
  double preview_s = 0.0;          ///< From the first forward beam to the foremost gun.
  std::vector<SpeedLimit> limits;  ///< The slowest first.
  std::vector<PlanFinding> findings;
};

/// Works out what a truck can do before it drives: at what speed each beam still sees every end of
/// a dash, what its noise does at the gun, what bends it stands, what a camera sees of beads.
///
/// Noise gain is the root of the sum of squared weights (`beam_weights`): 1.850 for beams at 8, 5
/// and -8 ft. The bend's error is that of the polynomial on a circle that touches the truck's axis
/// at the gun: 7.73 in for beams at 8 and -8 ft on 50 ft. Beads are seen within 0.3 degrees of the
/// light's way, says the report. With the path filter noise at the gun is smaller.
/// Thread-safe. Source: sections 2.1 and 2.2 of Advanced Retro Technology, *Automated Paint
/// Restriping Recognition and Guidance System*, UCD-ARR-91-11-01-01, 1991.
/// @throws Error as `GuidanceConfig::validate` and `TruckPlanOptions::validate` do.
TruckPlan plan_truck(const GuidanceConfig& truck, const TruckPlanOptions& options = {});

}  // namespace striper
