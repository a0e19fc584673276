// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include <striper/core/return_status.hpp>

namespace striper::wire {

/// The number of a status in messages and files of points: 0 ok, 1 saturated, 2 ambiguous, 3 wide,
/// 4 narrow, 5 weak, 6 edge, 7 out_of_range, 8 no_stripe, 9 blind, 10 behind, 11 outside_model, 13
/// outlier. Never changed, only appended.
std::uint8_t return_code(ReturnStatus status) noexcept;

/// The inverse; empty for a number that stands for none.
std::optional<ReturnStatus> return_status_from_code(std::uint8_t code) noexcept;

}  // namespace striper::wire
