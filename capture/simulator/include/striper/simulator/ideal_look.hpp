// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/model/stripe_look.hpp>
#include <striper/simulator/scene.hpp>

namespace striper {

/// How much of the light that falls on it white paper sends back, as the boards of data/scenes do.
inline constexpr double kWhitePaper = 0.85;

/// What the stripe of a scene's laser looks like on white paper that faces the laser, in closed
/// form: what a perfect calibration between two ranges would find. No colour: the simulator's
/// camera is grey. Amplitudes are those of the whole stripe, also where the converter ends below.
/// Ranges are left out where the fan does not reach into the image.
/// @param nearest_m, farthest_m of the laser's scan frame, above 0. Thread-safe.
StripeLook ideal_look(const Scene& scene, int laser, double nearest_m, double farthest_m);

/// The same over all ranges that the image shows, up to where a stripe is too faint (1 DN) or its
/// range cannot be told (a pixel is a quarter of it). About 2 ms.
StripeLook ideal_look(const Scene& scene, int laser);

}  // namespace striper
