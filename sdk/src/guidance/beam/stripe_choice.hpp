// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>

#include <striper/guidance/guidance_config.hpp>

#include "guidance/beam/beam_reader.hpp"

namespace striper::detail {

/// Where the followed line is expected under a beam; NaN where nothing is known.
struct ExpectedLine {
  double lateral_m = std::numeric_limits<double>::quiet_NaN();
  double within_m = std::numeric_limits<double>::infinity();
};

/// Which of the paint across one sweep is the stripe.
struct StripeFound {
  std::optional<std::size_t> followed;  ///< Line 0.
  std::optional<std::size_t> other;     ///< Line 1, of a double line.
  /// Where either is, or should be, lies something of another shape: whether paint is there cannot
  /// be told.
  bool is_followed_hidden = false;
  bool is_other_hidden = false;
  /// Worn paint where the line should be, too narrow to tell its middle.
  bool is_followed_worn = false;
  bool is_other_worn = false;
};

/// Chooses by the expected place; without one, of a double line the pair that is as far apart as it
/// should be, of a single one the line nearest to the window's middle.
StripeFound choose_stripe(std::span<const SeenPaint> seen, const GuidanceStripe& stripe,
                          const ExpectedLine& expected);

}  // namespace striper::detail
