// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/guidance/beam_sweep.hpp>
#include <striper/guidance/guidance_config.hpp>
#include <striper/scan/polar_scan.hpp>

namespace striper {

/// Turns a striper's scan across the road into a beam's sweep: its intensity at the beam's equally
/// spaced places, lateral position = y of the scan, straight between returns that are `ok`.
///
/// Where no return is near (five places), the sweep has the scan's median: no paint is seen there.
/// One flash has no skew: all samples are of one time. No allocation once `sweep` is large enough
/// but of a list of the returns.
/// @return false where the scan has fewer than two returns within the window.
bool sweep_of_scan(const PolarScan& scan, const GuidanceBeam& beam, BeamSweep& sweep);

}  // namespace striper
