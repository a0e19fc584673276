// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <striper/design/eye_safety.hpp>

namespace striper::detail {

/// Where a person's light is measured: which aperture, how far away.
struct Measurement {
  int condition;
  double aperture_m;
  double distance_m;
  double source_mrad;  ///< As what the source counts there.
};

/// Condition 1, then condition 3.
std::vector<Measurement> measurements(const EyeSafetyInput& input);

/// All limits of a class for what comes through one condition's aperture.
std::vector<EmissionCheck> checks_of(const EyeSafetyInput& input, EmissionLimit limit,
                                     const Measurement& at);

/// What the laser emits, in the unit of `EmissionCheck::largest`.
double emitted(const EyeSafetyInput& input);

}  // namespace striper::detail
