// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "stripe/track/bridge_rating.hpp"
#include "stripe/track/sure_returns.hpp"

namespace striper::detail {

/// What was measured in a gap between sure returns. Pixels of the image.
struct MeasuredPlace {
  double position, sigma;
  double height_dn;
  double free_off_px;  ///< From where it should be, where little holds it there.
};

/// How it lies and how high it is among the sure returns about it, and how sure those are.
void add_place(const ExpectedPlace& expected, const MeasuredPlace& measured, BridgeEvidence& e);

}  // namespace striper::detail
