// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <striper/core/event.hpp>
#include <striper/guidance/paint_gun.hpp>
#include <striper/motion/odometer.hpp>

namespace striper {

/// What a beam sees paint by.
enum class BeamKind {
  kRetro,    ///< Glass beads send light back where it came from: the report's scanned spot.
  kDiffuse,  ///< Paint is lighter than road: a striper's own laser and camera.
};

/// What a beam's sights are used for.
enum class BeamUse {
  kOff,
  kOldOnly,  ///< Not while the gun has painted what it looks at: fresh paint is where the gun was.
  kOn,
};

/// A beam that crosses the road, as it stands in `guidance.yaml`.
struct GuidanceBeam {
  std::string name;
  BeamKind kind = BeamKind::kRetro;
  double x_m = 0.0;          ///< Where it crosses the road, forward of the gun's reference.
  double y_left_m = 0.4572;  ///< Ends of its window; the report's 3 ft.
  double y_right_m = -0.4572;
  double height_m = 0.8636;  ///< Of the scanner above the road; the report's 34 in.
  double fan_rad = 0.0;  ///< Angle the window is swept through evenly; 0: equal steps on the road.
  double sweep_s = 0.0;  ///< From the first sample to the last.
  double rate_hz = 176.0;
  int samples = 142;
  int bits = 12;
  double threshold = std::numeric_limits<double>::quiet_NaN();  ///< NaN: automatic.
  /// Gain over the window, at equal distances from left to right; empty: learnt from bare road.
  std::vector<double> response;
  std::string head;  ///< Whose scans are the sweeps; empty: sweeps.csv has them.
  int laser = 0;
  BeamUse use = BeamUse::kOn;
  double zero_m =
      0.0;  ///< As aligned: what is at y of the window is at zero + scale y of the road.
  double scale = 1.0;

  /// Where sample `index` (0 the left end) is in the window. Design contract: y = y_mid + half
  /// tan(phi (1 - 2 i / (samples - 1))) / tan(phi), phi half the fan.
  double window_m(double index) const noexcept;
  /// Where that is beside the truck, by the beam's zero and scale.
  double lateral_m(double index) const noexcept { return zero_m + scale * window_m(index); }
  /// When, after the sweep's own time.
  double delay_s(double index) const noexcept;
  double sample_m() const noexcept;  ///< Between samples on the road, on average.
};

/// Which of a double line's two the path is.
enum class FollowLine { kSingle, kLeft, kRight };
enum class LinePattern { kAuto, kSolid, kDashed, kNone };

struct GuidanceLine {
  LinePattern pattern = LinePattern::kAuto;
  double dash_m = std::numeric_limits<double>::quiet_NaN();  ///< NaN: found out.
  double gap_m = std::numeric_limits<double>::quiet_NaN();
};

struct GuidanceStripe {
  double width_m = 0.1016;  ///< The report's 4 in.
  FollowLine follow = FollowLine::kSingle;
  double spacing_m = 0.0;  ///< Between the middles of a double line's two; 0: twice the width.
  std::vector<GuidanceLine> lines{GuidanceLine{}};  ///< Line 0 is the one that is followed.
  double end_extension_m = 0.0;
  double dash_min_m = 0.3;
  double gap_min_m = 0.3;
  double gap_limit_m = 15.0;   ///< A gap up to this is no fault.
  double marker_max_m = 0.15;  ///< What is shorter along the road is a raised marker or a spot.

  double line_spacing_m() const noexcept { return spacing_m > 0.0 ? spacing_m : 2.0 * width_m; }
};

struct GuidanceGun {
  std::string name = "gun";
  int line = 0;
  PaintGunOptions gun;  ///< Place, delays and advances; extension and least lengths as `stripe`.
  double on_delay_sd_s = 0.0;
  double off_delay_sd_s = 0.0;
};

/// Lateral position as a voltage, for the outrigger's drive.
struct GuidanceOutput {
  double offset_m = 0.0;
  double volts_per_m = -9.80315;  ///< The report's Figure 14: -.249 V/in.
  double volts_min = -10.0;
  double volts_max = 10.0;
  double volts_safe = 0.0;
  double offset_sd_m = 0.0;  ///< One sigma of `offset_m`, as aligned; it is in every lateral sigma.

  /// Within the limits; the safe value where it is not known.
  double volts(double lateral_m) const noexcept;
};

enum class PathMethod { kFilter, kReport, kExponential, kInteger };

struct GuidanceSmoothing {
  PathMethod method = PathMethod::kFilter;
  double alpha = 0.5;
};

enum class GuidanceFault {
  kNoStripe,    ///< Longer than the gap limit.
  kBeamSilent,  ///< A beam's sweeps stopped.
  kBeamBlind,   ///< A beam's sweeps are dark, clipped or the same again and again.
  kOdometer,    ///< Silent, or implausible.
  kMirror,      ///< It stands or turns at another rate: the laser would burn one place.
  kLaserOff,
  kTime,       ///< A sweep's time went back or jumped.
  kQueueFull,  ///< More dashes between beam and gun than fit.
};
inline constexpr std::size_t kGuidanceFaults = 8;

/// What a fault does.
enum class FaultAction {
  kStop,  ///< Guns off, the safe voltage.
  kHold,  ///< Guns off, the voltage stays.
  kWarn,  ///< It is said.
};

/// `no_stripe`, `beam_silent`, `beam_blind`, `odometer`, `mirror`, `laser_off`, `time`,
/// `queue_full`; `stop`, `hold`, `warn`. Static storage.
std::string_view to_string(GuidanceFault fault) noexcept;
std::string_view to_string(FaultAction action) noexcept;

/// All that `guidance.yaml` says: the truck, the stripe, the outputs.
struct GuidanceConfig {
  std::vector<GuidanceBeam> beams;
  OdometerOptions odometer;
  std::string odometer_source;
  std::vector<GuidanceGun> guns;
  GuidanceStripe stripe;
  GuidanceOutput output;
  GuidanceSmoothing smoothing;
  /// Of zero and scale of all beams in turn, row by row, as aligned; it is in every lateral sigma.
  /// Empty: not aligned.
  std::vector<double> alignment_covariance;
  std::array<FaultAction, kGuidanceFaults> faults{
      FaultAction::kStop, FaultAction::kWarn, FaultAction::kWarn, FaultAction::kStop,
      FaultAction::kStop, FaultAction::kStop, FaultAction::kWarn, FaultAction::kWarn};

  FaultAction action_of(GuidanceFault fault) const noexcept {
    return faults[static_cast<std::size_t>(fault)];
  }
  /// The options of a gun with what `stripe` says of all guns.
  PaintGunOptions gun_options(const GuidanceGun& gun) const;

  /// @throws Error{kBadValue} naming field, value and bound.
  void validate() const;
};

/// The truck of the 1991 report: beams at 8, 5 and -8 ft, 142 samples of 12 bits in 21.6 degrees,
/// 176 sweeps a second, 11.725 counts a foot.
GuidanceConfig report_truck();

/// Reads `guidance.yaml`. @throws Error{kBadFile} naming file, line, field, value and what was
/// expected; Error{kNotFound, kIo}.
GuidanceConfig load_guidance(const std::filesystem::path& path, const EventPort& events = {});
GuidanceConfig parse_guidance(const std::string& text, const std::string& name);
/// As `load_guidance` reads it.
std::string format_guidance(const GuidanceConfig& config);

}  // namespace striper
