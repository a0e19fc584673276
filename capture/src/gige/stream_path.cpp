// SPDX-License-Identifier: Apache-2.0
#include "gige/stream_path.hpp"

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "gige/gvcp.hpp"

namespace striper::detail {
namespace {

/// The socket that pictures would come to.
class StreamEnd {
 public:
  explicit StreamEnd(std::uint32_t address)
      : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    sockaddr_in local{};
    local.sin_family = AF_INET;
    local.sin_addr.s_addr = htonl(address);
    socklen_t length = sizeof(local);
    if (bind(fd_, reinterpret_cast<const sockaddr*>(&local), length) == 0 &&
        getsockname(fd_, reinterpret_cast<sockaddr*>(&local), &length) == 0) {
      port_ = ntohs(local.sin_port);
    }
  }
  StreamEnd(const StreamEnd&) = delete;
  StreamEnd& operator=(const StreamEnd&) = delete;
  ~StreamEnd() {
    if (fd_ >= 0) close(fd_);
  }

  std::uint32_t port() const noexcept { return port_; }

  /// Whether a packet with so many bytes of content comes soon.
  bool receives(std::size_t bytes) const {
    constexpr int kSoon_ms = 100;
    std::vector<std::uint8_t> packet(0x10000);
    pollfd waiting{fd_, POLLIN, 0};
    while (poll(&waiting, 1, kSoon_ms) > 0) {
      const ssize_t got = recv(fd_, packet.data(), packet.size(), 0);
      if (got == static_cast<ssize_t>(bytes)) return true;
    }
    return false;
  }

 private:
  int fd_;
  std::uint32_t port_ = 0;
};

}  // namespace

std::optional<std::vector<int>> sizes_that_arrive(const GvcpDevice& device,
                                                  const std::vector<int>& sizes) {
  constexpr int kHeaders = 28;  // IP and UDP
  constexpr int kAttempts = 3;
  const StreamEnd end(device.interface_address);
  GvcpControl control(device);
  if (!control.is_ours() || end.port() == 0) return std::nullopt;
  control.write(gvcp::kStreamDestination, device.interface_address);
  control.write(gvcp::kStreamPort, end.port());
  std::vector<int> arrived;
  for (const int size : sizes) {
    const auto request =
        gvcp::kFireTestPacket | gvcp::kDoNotFragment | static_cast<std::uint32_t>(size);
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      control.write(gvcp::kStreamPacketSize, request);
      if (!end.receives(static_cast<std::size_t>(size - kHeaders))) continue;
      arrived.push_back(size);
      break;
    }
  }
  control.write(gvcp::kStreamPort, 0);
  return arrived;
}

}  // namespace striper::detail
