// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/design/eye_safety.hpp>

namespace striper::detail {

/// The shortest and the longest pulse of the one rule of ANSI Z136.1-1993 that is known here.
inline constexpr double kAnsiShortest_s = 1e-9;
inline constexpr double kAnsiLongest_s = 18e-6;

/// Judges pulses as Mertz et al. 2002, "Eye safety", do: C_A = 10^(2 (l - .7)), C_p = (10 s rate)
/// ^-.25, MPE = .5 C_p C_A uJ/cm^2 on a pupil of .385 cm^2.
EyeSafetyReport assess_ansi_1993(const EyeSafetyInput& input);

}  // namespace striper::detail
