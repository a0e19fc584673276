// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <iterator>

#include <striper/wire/return_code.hpp>

namespace striper::wire {
namespace {

// By the enumerators' order, which may change; these numbers must not. 12 is kept for returns that
// were filled in.
constexpr std::array<std::uint8_t, kReturnStatusCount> kCodes = [] {
  std::array<std::uint8_t, kReturnStatusCount> codes{};
  const auto set = [&](ReturnStatus status, std::uint8_t code) {
    codes[static_cast<std::size_t>(status)] = code;
  };
  set(ReturnStatus::kOk, 0);
  set(ReturnStatus::kSaturated, 1);
  set(ReturnStatus::kAmbiguous, 2);
  set(ReturnStatus::kWide, 3);
  set(ReturnStatus::kNarrow, 4);
  set(ReturnStatus::kWeak, 5);
  set(ReturnStatus::kEdge, 6);
  set(ReturnStatus::kOutOfRange, 7);
  set(ReturnStatus::kNoStripe, 8);
  set(ReturnStatus::kBlind, 9);
  set(ReturnStatus::kBehind, 10);
  set(ReturnStatus::kOutsideModel, 11);
  set(ReturnStatus::kOutlier, 13);
  return codes;
}();

}  // namespace

std::uint8_t return_code(ReturnStatus status) noexcept {
  return kCodes[static_cast<std::size_t>(status)];
}

std::optional<ReturnStatus> return_status_from_code(std::uint8_t code) noexcept {
  const auto* found = std::find(kCodes.begin(), kCodes.end(), code);
  if (found == kCodes.end()) return std::nullopt;
  return static_cast<ReturnStatus>(std::distance(kCodes.begin(), found));
}

}  // namespace striper::wire
