// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <striper/design/iec60825.hpp>

namespace striper {

/// Which rules a laser is judged by.
enum class LaserStandard {
  kIec2014,   ///< IEC 60825-1:2014, classes 1 to 4.
  kAnsi1993,  ///< ANSI Z136.1-1993 as Mertz et al. 2002 use it: one rule, for trains of pulses.
};

/// Regular pulses. @see EyeSafetyInput
struct PulsedEmission {
  double energy_j = 0.0;  ///< Of one pulse, 0 or more.
  double pulse_s = 1e-6;  ///< 1e-13 to .25; what is longer is continuous.
  double rate_hz = 30.0;  ///< Above 0, at most one pulse after the other.
};

/// A steady beam, and where it is moved, how fast.
struct ContinuousEmission {
  double power_w = 0.0;
  /// Angular speed of a scanned beam. It counts only because a safeguard switches the laser off
  /// when the scan fails; the beam passes an eye once a turn.
  std::optional<double> scan_speed_rad_s = std::nullopt;
};

/// The light of a laser plane, from one point, even across both angles.
struct FanBeam {
  double fan_rad = 0.0;        ///< Above 0, at most pi.
  double thickness_rad = 0.0;  ///< Above 0, at most the fan.
};

/// A round beam. Diameters hold 63 % of a Gaussian beam's light, as the standard has them.
struct RoundBeam {
  double diameter_m = 0.0;      ///< Where it leaves the laser.
  double divergence_rad = 0.0;  ///< Full angle.
};

/// All of the light through any aperture: what to assume where nothing is known.
struct UnknownBeam {};

/// A laser and how near one gets to it.
struct EyeSafetyInput {
  LaserStandard standard = LaserStandard::kIec2014;
  double wavelength_nm = 900.0;
  std::variant<PulsedEmission, ContinuousEmission> emission;
  std::variant<UnknownBeam, FanBeam, RoundBeam> beam;
  /// How near a person can come to the point that the light spreads from.
  double closest_m = 0.0;
  /// Angular subtense of the apparent source, seen from there (condition 3). Condition 1, with its
  /// telescope at 2 m, is always judged as of a point source, which is stricter.
  double source_mrad = kPointSource_mrad;

  /// @throws Error{kBadValue} naming the field, the value and the bound.
  void validate() const;
};

/// Laser classes; those that ANSI is not asked for are above 1.
enum class LaserClass { k1, k1M, k2, k2M, k3R, k3B, k4, kAbove1 };

/// `1`, `1M`, ... Static storage.
std::string_view to_string(LaserClass laser_class) noexcept;

/// One limit of class 1 and what it allows the laser to emit.
struct EmissionCheck {
  std::string rule;      ///< single_pulse, mean_power, pulse_train, photochemical.
  int condition = 3;     ///< 1: 50 mm at 2 m (telescope); 3: 7 mm at 100 mm (the bare eye).
  std::string table;     ///< Where the limit comes from.
  double ael = 0.0;      ///< Through the aperture.
  std::string unit;      ///< Of the AEL: J or W; of a pulse where energies are compared.
  double largest = 0.0;  ///< Emitted: J of a pulse, or W of a continuous beam.
};

/// A number on the way to the answer.
struct EyeSafetyStep {
  std::string name;
  double value = 0.0;
  std::string unit;
};

/// What a laser's class is and why. No certificate: see `not_checked`.
struct EyeSafetyReport {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  LaserClass laser_class = LaserClass::k4;
  EmissionCheck limiting;             ///< The strictest limit of class 1 (ANSI: the MPE).
  double fraction_of_limit = 0.0;     ///< What is emitted over what `limiting` allows.
  double max_energy_j = kNone;        ///< The largest pulse of class 1, all else unchanged.
  double max_power_w = kNone;         ///< The largest mean power of class 1, all else unchanged.
  double closest_safe_m = kNone;      ///< Class 1 from here on; NaN where it is at no distance.
  double closest_unaided_m = kNone;   ///< The same without telescopes: condition 3 alone.
  std::vector<EmissionCheck> checks;  ///< All limits of class 1.
  std::vector<EyeSafetyStep> steps;
  std::vector<std::string> not_checked;  ///< What a person has to look at.
};

/// Judges a laser. Class 1 (100 s), 2 and visible 3R (.25 s), 1M, 2M, 3R, 3B, 4 after
/// IEC 60825-1:2014: single pulse, mean power and train of pulses (C5; pulses within T_i are
/// summed) through condition 1 at max(2 m, closest) and condition 3 at max(.1 m, closest); or the
/// one rule of ANSI Z136.1-1993 that Mertz et al. 2002 use, with their 10.43 uJ.
/// Cost: some 10 us, most of it the closest approach. Thread-safe.
/// @throws Error{kBadValue} as `EyeSafetyInput::validate`.
EyeSafetyReport assess_eye_safety(const EyeSafetyInput& input);

/// The share of a beam that an aperture lets through, 0 to 1.
/// @param distance_m from where the light spreads, above 0.
double aperture_share(const std::variant<UnknownBeam, FanBeam, RoundBeam>& beam, double aperture_m,
                      double distance_m);

}  // namespace striper
