// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <striper/core/event.hpp>

namespace striper::detail {

/// The port to which every program of a domain listens for others: DDSI-RTPS 2.3, 9.6.1.1.
constexpr std::uint16_t discovery_port(std::uint32_t domain) {
  return static_cast<std::uint16_t>(7400 + 250 * domain);
}

/// Whether an interface is there, is up, has an address, and brings what is sent to everybody in
/// the domain (239.255.0.1): one packet is sent, which DDS programs ignore.
/// @param interface its name.
std::vector<Event> examine_interface(const std::string& interface, std::uint32_t domain);

}  // namespace striper::detail
