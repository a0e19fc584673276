// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "stripe/select/stripe_choice.hpp"

namespace striper::detail {

std::array<float, Evidence::kCount>& dev_weights();
/// The log odds that what shows such evidence is the stripe.
float weigh_evidence(const Evidence& evidence) noexcept;

}  // namespace striper::detail
