// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/model/striper_model.hpp>
#include <striper/scan/scan_options.hpp>
#include <striper/stripe/expected_stripe.hpp>

namespace striper {

/// Says where a model's laser can be seen, and how wide its stripe is there.
///
/// A pixel can show the stripe if its ray meets the laser plane in front of the camera within the
/// limits of range: those of `limits` where they were set, else half the nearest to three times the
/// farthest range that the calibration saw (`StripeLook`), else any. A few pixels are added on
/// either side. The width is that of the look along the middle of the sensor, a straight line over
/// the position across.
///
/// About .5 ms. @throws Error{kBadValue} where the model has no such laser.
ExpectedStripe expect_stripe(const StriperModel& model, int laser, const ScanOptions& limits);

}  // namespace striper
