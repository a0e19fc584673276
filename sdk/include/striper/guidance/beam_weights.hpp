// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

namespace striper {

/// Weigh what the beams see of a paint stripe so that the weighted sum of their lateral positions
/// is the stripe's at another place: the polynomial through all beams (three: the parabola
/// y = a x^2 + b x + c; two: the straight line; one: a parallel). The weights depend on where the
/// beams are alone, so that noise of the sum is the root of the sum of (weight * sigma)^2.
///
/// @param beam_x_m where the beams cross the road, metres forward of the gun, no two alike
/// @param at_x_m where the position is wanted, metres forward of the gun
/// @return a weight for each beam, in their order; their sum is 1
/// @throws Error kBadValue without beams, and if two beams are at one place or not finite
/// Thread-safe; allocates the result: for set-up, or when a beam goes missing.
/// Source: Lagrange's form of the fit in section 2.3 of Advanced Retro Technology, *Automated Paint
/// Restriping Recognition and Guidance System*, UCD-ARR-91-11-01-01, 1991.
std::vector<double> beam_weights(std::span<const double> beam_x_m, double at_x_m = 0.0);

}  // namespace striper
