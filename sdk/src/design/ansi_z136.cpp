// SPDX-License-Identifier: Apache-2.0
#include "design/ansi_z136.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

constexpr double kPupil_m = 0.007;
constexpr double kPupil_cm2 = 0.385;  // As the paper prints it; pi .35^2 is .38485.
constexpr double kNearestEye_m = 0.1;

double mpe_j_cm2(double wavelength_nm, double rate_hz) {
  constexpr double kLooking_s = 10.0;
  const double ca = std::pow(10.0, 2.0 * std::max(1e-3 * wavelength_nm - 0.7, 0.0));
  const double cp = std::pow(std::max(kLooking_s * rate_hz, 1.0), -0.25);
  return 0.5e-6 * cp * ca;
}

// What a pupil at this distance gets of the emitted pulse.
double pupil_share(const EyeSafetyInput& input, double closest_m) {
  return aperture_share(input.beam, kPupil_m, std::max(kNearestEye_m, closest_m));
}

// Where the pupil's share has fallen to this; NaN where it does at no distance.
double distance_of_share_m(const EyeSafetyInput& input, double share) {
  double near_m = 0.0;
  double far_m = 1e4;
  if (pupil_share(input, near_m) <= share) return near_m;
  if (pupil_share(input, far_m) > share) return EyeSafetyReport::kNone;
  for (int n = 0; n < 60; ++n) {
    const double middle_m = 0.5 * (near_m + far_m);
    (pupil_share(input, middle_m) <= share ? far_m : near_m) = middle_m;
  }
  return far_m;
}

}  // namespace

EyeSafetyReport assess_ansi_1993(const EyeSafetyInput& input) {
  const auto& pulses = std::get<PulsedEmission>(input.emission);
  const double share = pupil_share(input, input.closest_m);
  const double mpe = mpe_j_cm2(input.wavelength_nm, pulses.rate_hz);
  const double pupil_j = mpe * kPupil_cm2;

  EyeSafetyReport report;
  report.limiting = {"pulse_train", 3,   "ANSI Z136.1-1993 (Mertz et al. 2002)",
                     pupil_j,       "J", pupil_j / share};
  report.checks = {report.limiting};
  report.max_energy_j = report.limiting.largest;
  report.max_power_w = report.max_energy_j * pulses.rate_hz;
  report.fraction_of_limit = pulses.energy_j / report.max_energy_j;
  report.laser_class = report.fraction_of_limit <= 1.0 ? LaserClass::k1 : LaserClass::kAbove1;
  report.closest_safe_m =
      distance_of_share_m(input, pulses.energy_j > 0.0 ? pupil_j / pulses.energy_j : 1.0);
  report.closest_unaided_m = report.closest_safe_m;
  report.steps = {
      {"C_A", std::pow(10.0, 2.0 * std::max(1e-3 * input.wavelength_nm - 0.7, 0.0)), ""},
      {"C_p", std::pow(std::max(10.0 * pulses.rate_hz, 1.0), -0.25), ""},
      {"MPE", mpe, "J/cm2"},
      {"pupil", kPupil_cm2, "cm2"},
      {"geometry", 1.0 / share, ""},
      {"energy", report.max_energy_j, "J"},
      {"mean power", report.max_power_w, "W"}};
  report.not_checked = {
      "One rule of many: the limits for a single pulse and for the mean power are not looked at.",
      "The standard's text: formulas and figures are those of Mertz et al. 2002, which were read.",
      "Today's classes: IEC 60825-1:2014 asks for a telescope too (--standard iec2014)."};
  return report;
}

}  // namespace striper::detail
