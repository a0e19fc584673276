// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "stripe/select/stripe_choice.hpp"

namespace striper::detail {

/// One term of the log odds: weight * max(0, evidence - knot). The terms of one kind are a
/// piecewise linear function of it.
struct ChoiceTerm {
  Evidence::Kind kind;
  float knot;
  float weight;
};

/// What belongs to a candidate's piece and frame, and to the candidate itself.
std::span<const ChoiceTerm> piece_terms() noexcept;
std::span<const ChoiceTerm> own_terms() noexcept;

/// The sum of terms: the log odds that what shows such evidence is the stripe.
float weigh(std::span<const ChoiceTerm> terms, const Evidence& evidence) noexcept;

}  // namespace striper::detail
