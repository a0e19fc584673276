// SPDX-License-Identifier: Apache-2.0
#include "register_log.hpp"

#include <fmt/format.h>

#include "gige/protocol/gvcp.hpp"
#include "live/host_clock.hpp"

namespace striper::detail {
namespace {

// Those of the bootstrap registers that no GenICam feature stands for.
const char* bootstrap_name(std::uint32_t address) noexcept {
  switch (address) {
    case gvcp::kControlPrivilege:
      return "ControlChannelPrivilege";
    case gvcp::kStreamPort:
      return "StreamChannelPort";
    case gvcp::kStreamDestination:
      return "StreamChannelDestination";
    case gvcp::kTimestampControl:
      return "TimestampControl";
    default:
      return nullptr;
  }
}

}  // namespace

std::string RegisterNames::of(std::uint32_t address, std::uint32_t value) const {
  if (const auto found = commands.find({address, value}); found != commands.end()) {
    return found->second;
  }
  if (const auto found = registers.find(address); found != registers.end()) return found->second;
  if (const char* const name = bootstrap_name(address)) return name;
  return fmt::format("0x{:04x}", address);
}

void RegisterLog::note(std::uint64_t controller, std::uint32_t address, std::uint32_t value,
                       bool is_laser_armed) {
  if (writes_.size() == kMost) writes_.pop_front();
  writes_.push_back(
      {monotonic_now_ns(), controller, names_.of(address, value), value, is_laser_armed});
}

}  // namespace striper::detail
