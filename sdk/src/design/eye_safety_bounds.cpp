// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/design/eye_safety.hpp>

#include "design/ansi_z136.hpp"
#include "design/bounds.hpp"

namespace striper {
namespace {

using detail::require_at_least;
using detail::require_between;

void validate_wavelength(double wavelength_nm) {
  if (wavelength_nm >= kShortestWavelength_nm && wavelength_nm <= kLongestWavelength_nm) return;
  const char* const why =
      wavelength_nm > kLongestWavelength_nm
          ? ": beyond, limits have another shape (C7, T_i of 13 us, the cornea), which was not "
            "cross-checked"
      : wavelength_nm < kShortestWavelength_nm ? ": below, ultraviolet limits begin"
                                               : "";
  throw Error(ErrorKind::kBadValue,
              fmt::format("wavelength_nm is {:g}, expected {:g} to {:g}{}", wavelength_nm,
                          kShortestWavelength_nm, kLongestWavelength_nm, why));
}

void validate(const PulsedEmission& pulses) {
  require_at_least("energy_j", pulses.energy_j, 0.0);
  require_between("pulse_s", pulses.pulse_s, 1e-13, 0.25);
  require_between("rate_hz", pulses.rate_hz, 1e-6, 1e9);
  if (pulses.pulse_s * pulses.rate_hz > 1.0)
    throw Error(ErrorKind::kBadValue,
                fmt::format("rate_hz is {:g}, expected at most {:g}, one pulse of {:g} s after the "
                            "other (what is always on is continuous)",
                            pulses.rate_hz, 1.0 / pulses.pulse_s, pulses.pulse_s));
}

void validate(const ContinuousEmission& steady) {
  require_at_least("power_w", steady.power_w, 0.0);
  // Slower, the beam stands on an eye for longer than the blink reflex.
  if (steady.scan_speed_rad_s)
    require_between("scan_speed_rad_s", *steady.scan_speed_rad_s, 1.0, 1e6);
}

void validate(const UnknownBeam&) {}

void validate(const FanBeam& fan) {
  require_between("fan_rad", fan.fan_rad, 1e-6, std::numbers::pi);
  require_between("thickness_rad", fan.thickness_rad, 1e-6, std::numbers::pi);
}

void validate(const RoundBeam& round) {
  require_between("diameter_m", round.diameter_m, 0.0, 1.0);
  require_between("divergence_rad", round.divergence_rad, 0.0, std::numbers::pi);
}

void validate_ansi(const EyeSafetyInput& input) {
  const auto* pulses = std::get_if<PulsedEmission>(&input.emission);
  if (pulses == nullptr)
    throw Error(ErrorKind::kBadValue,
                "power_w is given, expected pulses: of ANSI Z136.1-1993 only the rule for trains "
                "of pulses is known");
  require_between("pulse_s", pulses->pulse_s, detail::kAnsiShortest_s, detail::kAnsiLongest_s);
}

}  // namespace

void EyeSafetyInput::validate() const {
  validate_wavelength(wavelength_nm);
  std::visit([](const auto& one) { striper::validate(one); }, emission);
  std::visit([](const auto& one) { striper::validate(one); }, beam);
  require_between("closest_m", closest_m, 0.0, 1e4);
  require_between("source_mrad", source_mrad, kPointSource_mrad, 100.0);
  if (standard == LaserStandard::kAnsi1993) validate_ansi(*this);
}

}  // namespace striper
