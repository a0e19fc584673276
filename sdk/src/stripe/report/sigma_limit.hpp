// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "stripe/report/what_is_right.hpp"
#include "stripe/select/stripe_choice.hpp"

namespace striper::detail {

/// The greatest sigma that a return has where that candidate was chosen, sensor pixels.
/// @param step sensor pixels of one of the image's.
inline float sigma_limit_px(const StripeChoice& choice, std::int32_t candidate, double step) {
  const Candidate& c = choice.pieces().candidate(static_cast<std::size_t>(candidate));
  const double width = choice.width().at(static_cast<double>(c.across));
  return static_cast<float>(step) * most_sigma_px(static_cast<float>(width));
}

}  // namespace striper::detail
