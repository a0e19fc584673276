// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

// The kernel's reverse-path filter throws away what comes from an address that it would not send to
// by the same interface: the answers of a camera on another subnet.
namespace striper::detail {

/// Whether it is strict on this interface (net.ipv4.conf.*.rp_filter = 1).
bool filters_by_reverse_path(const std::string& interface);

/// Packets that it threw away since this machine started; 0 where the kernel does not tell.
std::uint64_t reverse_path_drops();

}  // namespace striper::detail
