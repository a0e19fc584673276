// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include <striper/core/return_status.hpp>

namespace striper::wire {

/// The number of a status in messages and files of points: that of its enumerator, 0 ok to 13
/// outlier. Never changed, only appended.
std::uint8_t return_code(ReturnStatus status) noexcept;

/// The inverse; empty for a number that stands for none.
std::optional<ReturnStatus> return_status_from_code(std::uint8_t code) noexcept;

}  // namespace striper::wire
