// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "ambient/illumination/line_sign.hpp"
#include "ambient/pixels/held_exposure.hpp"

namespace striper::detail {

/// Watches whether the line of each laser shows where the cadence has it.
class LineWatch {
 public:
  explicit LineWatch(StripeAxis axis) noexcept : axis_(axis) {}

  /// Whether the cadence cannot be: the line is dark in `lit - dark`, or was plain and is gone, or
  /// shows in one dark exposure and not in the other.
  bool refutes(const LitFrame& lit, const Neighbours& darks);

 private:
  StripeAxis axis_;
  LineSign sign_;
  std::vector<bool> was_plain_;  // Per laser: its line, in the last exposure that it lit.
};

}  // namespace striper::detail
