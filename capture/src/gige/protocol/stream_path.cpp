// SPDX-License-Identifier: Apache-2.0
#include "gige/protocol/stream_path.hpp"

#include <chrono>

#include "gige/protocol/gvcp.hpp"
#include "gige/protocol/udp_socket.hpp"

namespace striper::detail {
namespace {

/// Whether a packet with so many bytes of content comes soon.
bool receives(const UdpSocket& stream_end, std::size_t bytes) {
  constexpr std::chrono::milliseconds kSoon{100};
  std::vector<std::uint8_t> packet(0x10000);
  while (stream_end.wait(kSoon)) {
    if (stream_end.receive(packet) == bytes) return true;
  }
  return false;
}

}  // namespace

std::optional<std::vector<int>> sizes_that_arrive(const GvcpDevice& device,
                                                  const std::vector<int>& sizes) {
  constexpr int kHeaders = 28;  // IP and UDP
  constexpr int kAttempts = 3;
  const UdpSocket stream_end(device.interface_address);
  GvcpControl control(device);
  if (!control.is_ours() || !stream_end.is_open()) return std::nullopt;
  control.write(gvcp::kStreamDestination, device.interface_address);
  control.write(gvcp::kStreamPort, stream_end.port());
  std::vector<int> arrived;
  for (const int size : sizes) {
    const auto request =
        gvcp::kFireTestPacket | gvcp::kDoNotFragment | static_cast<std::uint32_t>(size);
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      control.write(gvcp::kStreamPacketSize, request);
      if (!receives(stream_end, static_cast<std::size_t>(size - kHeaders))) continue;
      arrived.push_back(size);
      break;
    }
  }
  control.write(gvcp::kStreamPort, 0);
  return arrived;
}

}  // namespace striper::detail
