// SPDX-License-Identifier: Apache-2.0
#include "gige/protocol/udp_socket.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace striper::detail {

sockaddr_in socket_address(std::uint32_t address, std::uint16_t port) noexcept {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_port = htons(port);
  result.sin_addr.s_addr = htonl(address);
  return result;
}

UdpSocket::UdpSocket() : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  const int yes = 1;
  setsockopt(fd_, SOL_SOCKET, SO_BROADCAST, &yes, sizeof(yes));
  setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
}

UdpSocket::UdpSocket(std::uint32_t local_address) : UdpSocket() { bind_to(local_address, 0); }

std::unique_ptr<UdpSocket> UdpSocket::for_broadcasts(const UdpSocket& to,
                                                     const std::string& interface) {
  auto result = std::unique_ptr<UdpSocket>(new UdpSocket());
  const auto length = static_cast<socklen_t>(interface.size());
  if (setsockopt(result->fd_, SOL_SOCKET, SO_BINDTODEVICE, interface.data(), length) == 0) {
    result->bind_to(INADDR_ANY, to.port());
  }
  return result;
}

UdpSocket::~UdpSocket() {
  if (fd_ >= 0) close(fd_);
}

void UdpSocket::bind_to(std::uint32_t local_address, std::uint16_t port) noexcept {
  const sockaddr_in local = socket_address(local_address, port);
  is_open_ = fd_ >= 0 && bind(fd_, reinterpret_cast<const sockaddr*>(&local), sizeof(local)) == 0;
}

std::uint16_t UdpSocket::port() const noexcept {
  sockaddr_in local{};
  socklen_t length = sizeof(local);
  getsockname(fd_, reinterpret_cast<sockaddr*>(&local), &length);
  return ntohs(local.sin_port);
}

bool UdpSocket::send(const sockaddr_in& to, std::span<const std::uint8_t> data) const noexcept {
  return sendto(fd_, data.data(), data.size(), 0, reinterpret_cast<const sockaddr*>(&to),
                sizeof(to)) == static_cast<ssize_t>(data.size());
}

std::size_t UdpSocket::receive(std::span<std::uint8_t> packet) const noexcept {
  std::uint32_t sender = 0;
  return receive(packet, sender);
}

std::size_t UdpSocket::receive(std::span<std::uint8_t> packet,
                               std::uint32_t& sender) const noexcept {
  sockaddr_in from{};
  socklen_t length = sizeof(from);
  const ssize_t got =
      recvfrom(fd_, packet.data(), packet.size(), 0, reinterpret_cast<sockaddr*>(&from), &length);
  sender = ntohl(from.sin_addr.s_addr);
  return got > 0 ? static_cast<std::size_t>(got) : 0;
}

bool UdpSocket::wait(std::chrono::milliseconds patience) const noexcept {
  pollfd waiting{fd_, POLLIN, 0};
  return poll(&waiting, 1, static_cast<int>(patience.count())) > 0;
}

}  // namespace striper::detail
