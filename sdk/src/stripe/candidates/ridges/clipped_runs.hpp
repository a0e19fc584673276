// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "stripe/candidates/ridges/ridges.hpp"

namespace striper::detail {

/// Clipped pixels of a stripe twenty times full scale, in its widths: 2 sqrt(2 ln 20).
inline constexpr float kMostClippedWidths = 5.0F;

/// Runs of clipped pixels across the stripe. No pixel of one that is twice as long as the distance
/// at which ridges are compared, or longer, rises above both of the pixels that it is compared
/// with: an overexposed stripe is no ridge.
///
/// One pass over the image in the order of memory, and one over each scan line that has clipped
/// pixels. No allocation after the first frame of a size.
class ClippedRuns {
 public:
  /// Which runs may be a stripe.
  struct Limits {
    int distance_px = 1;  ///< From a run's ends to the pixels it is compared with, as of ridges.
    int most_px = 1;      ///< A longer run is a light source or a bright surface.
    int least_dn = 1;     ///< Of its rise above the brighter of those two.
  };

  /// Makes room for frames of this size and type.
  void reserve(const LitFrame& frame, StripeAxis axis);

  /// Puts the middle of every such run in the place of the ridges among its pixels. Masked
  /// pixels are none.
  void add_to(Ridges& ridges, const LitFrame& frame, StripeAxis axis, const Limits& limits);

 private:
  cv::Mat brightest_;  // Of each scan line, in the lit exposure.
};

}  // namespace striper::detail
