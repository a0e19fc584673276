// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace striper {

// The limits of IEC 60825-1:2014 for 400 to 1050 nm, written down from two public codes that agree
// with each other and from memory, not from the standard's text. Pure functions, thread-safe,
// nanoseconds each; the wavelength has to be from kShortestWavelength_nm to kLongestWavelength_nm.

/// Below, ultraviolet limits begin; above, another shape of limits (C7, C4 = 5, T_i of 13 us, the
/// cornea) that was not cross-checked.
inline constexpr double kShortestWavelength_nm = 400.0;
inline constexpr double kLongestWavelength_nm = 1050.0;

/// The smallest angular subtense that counts as such, milliradians: a point source.
inline constexpr double kPointSource_mrad = 1.5;

/// Classes of emission limits (AEL) that can be had from formulas; 1M and 2M are not: they use
/// those of 1 and 2 with other conditions of measurement.
enum class EmissionLimit { kClass1, kClass2, kClass3R, kClass3B };

/// Wavelengths of which the eye turns away: 400 to 700 nm. Only these can be of class 2.
bool is_visible(double wavelength_nm) noexcept;

/// T_i, seconds: pulses that come within it act as one. 5 us up to 1050 nm.
inline constexpr double kThermalConfinement_s = 5e-6;

double c3(double wavelength_nm) noexcept;  ///< 1 to 450 nm, then 10^(.02 (l - 450)) to 600 nm.
double c4(double wavelength_nm) noexcept;  ///< 1 to 700 nm, then 10^(.002 (l - 700)).

/// The largest subtense that counts after an exposure of `seconds`: 5 mrad up to 625 us,
/// 200 sqrt(t), 100 mrad from .25 s on.
double alpha_max_mrad(double seconds) noexcept;

/// The factor of an extended source, alpha over 1.5 mrad, at most alpha_max over it; 1 for a point.
double c6(double source_mrad, double seconds) noexcept;

/// T2: from this exposure on only the power counts. 10 s for a point source, 100 s from 100 mrad.
double t2_s(double source_mrad) noexcept;

/// How long a beam of this class may be looked into: 100 s; .25 s for visible class 2 and 3R.
double time_base_s(EmissionLimit limit, double wavelength_nm) noexcept;

/// The factor of a train of pulses.
/// @param pulse_s of one pulse. @param pulses of the train within the shorter of T2 and time base.
double c5(double pulse_s, double pulses, double source_mrad, double time_base_s) noexcept;

/// The energy of a single exposure of `seconds` (1e-13 to 3e4) that a class allows through the
/// aperture, joules: Table 3 (class 1) and those of classes 2, 3R and 3B. For 1 us at 900 nm and
/// class 1: .1934 uJ. A power limit is this over the seconds.
double emission_limit_j(EmissionLimit limit, double wavelength_nm, double seconds,
                        double source_mrad);

/// The same for photochemical damage, of class 1, 400 to 600 nm and from 10 s on; empty elsewhere.
std::optional<double> photochemical_limit_j(double wavelength_nm, double seconds) noexcept;

}  // namespace striper
