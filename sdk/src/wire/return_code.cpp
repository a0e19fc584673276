// SPDX-License-Identifier: Apache-2.0
#include <striper/wire/return_code.hpp>

namespace striper::wire {

std::uint8_t return_code(ReturnStatus status) noexcept { return static_cast<std::uint8_t>(status); }

std::optional<ReturnStatus> return_status_from_code(std::uint8_t code) noexcept {
  if (code >= kReturnStatusCount) return std::nullopt;
  return static_cast<ReturnStatus>(code);
}

}  // namespace striper::wire
