// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include <striper/scan/polar_scan.hpp>
#include <striper/stripe/line_explanation.hpp>

namespace striper {

/// Why a scan line of the image gave its return: what was in it, what was chosen, and what a pixel
/// or a degree means there.
struct ScanExplanation {
  LineExplanation line;
  Return result;  ///< What the scan has; status says the reason where there is nothing.

  /// How the range changes with the position across the stripe, per sensor pixel, and with the
  /// angle between the camera's ray and the laser's plane. NaN without a model or without a return.
  double range_m_per_px = std::numeric_limits<double>::quiet_NaN();
  double range_m_per_deg = range_m_per_px;
};

/// Puts them together. @param scan the scan that the scan line's frame gave.
ScanExplanation explain_return(const LineExplanation& line, const PolarScan& scan);

}  // namespace striper
