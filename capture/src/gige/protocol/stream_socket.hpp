// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

// Aravis keeps the socket that packets come in on to itself; it is found among this process' own by
// its port.
namespace striper::detail {

/// Makes the receive buffer of the UDP socket at `port` this large, past net.core.rmem_max where
/// the process may (CAP_NET_ADMIN). @return what is in force, bytes; 0 where there is no such
/// socket.
int set_receive_buffer(int port, int bytes);

/// Packets that the kernel threw away because the buffer was full.
std::optional<std::uint64_t> receive_drops(int port);

}  // namespace striper::detail
