// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/stripe/extractor.hpp>

#include "stripe/candidates/detection.hpp"
#include "stripe/candidates/peak_list.hpp"
#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {

/// What a peak is compared with. Lengths in pixels of the image.
struct PeakLimits {
  float significance;       // Below, there is no stripe,
  float weak_significance;  // and below this it is weak.
  float amplitude;
  float snr;
  float narrow, wide;  // Multiples of the expected width.
  float saturated_sigma;
  float width, width_slope;  // Expected at pixel 0 (pixel box included), and its change per pixel.
  float last;                // Pixel of the scan line.
  float step;                // Sensor pixels per pixel.
  const float* not_noise;    // See Detection.
};

PeakLimits limits_of(const ExtractOptions& options, const Detection& detection,
                     const WidthModel& width, int length, double step);

/// Says of every peak whether it is the stripe, or why not, and turns its error and width into
/// those that are reported: sensor pixels, and the stripe's own Gaussian sigma. The numbers of what
/// is no stripe become NaN. Half a nanosecond a peak.
void judge_peaks(const PeakLimits& limits, PeakList& peaks);

}  // namespace striper::detail
