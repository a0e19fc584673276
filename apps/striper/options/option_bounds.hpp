// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/command.hpp"

namespace striper::program {

/// Accepts finite numbers from `low` to `high`, both included; NaN is none. The message quotes the
/// word and the bounds.
WordCheck between(double low, double high);

/// Accepts finite numbers from `low` on.
WordCheck at_least(double low);

/// Accepts finite numbers but 0.
WordCheck not_zero();

}  // namespace striper::program
