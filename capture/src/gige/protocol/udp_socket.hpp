// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include <netinet/in.h>

namespace striper::detail {

sockaddr_in socket_address(std::uint32_t address, std::uint16_t port) noexcept;

/// A UDP socket of IPv4 that never blocks. Addresses are in this machine's byte order.
class UdpSocket {
 public:
  /// At one of this machine's addresses, and a port of the kernel's choice.
  explicit UdpSocket(std::uint32_t local_address);

  /// Hears what is broadcast to the port of another socket, on one interface. (One that has an
  /// address hears only what is sent to that.) Not open where the kernel does not let it.
  static std::unique_ptr<UdpSocket> for_broadcasts(const UdpSocket& to,
                                                   const std::string& interface);

  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;
  ~UdpSocket();

  /// False where the constructor did not succeed: then nothing is sent and nothing comes.
  bool is_open() const noexcept { return is_open_; }
  int fd() const noexcept { return fd_; }
  std::uint16_t port() const noexcept;

  /// @return whether the kernel took it whole.
  bool send(const sockaddr_in& to, std::span<const std::uint8_t> data) const noexcept;

  /// Takes one packet; what does not fit is cut off. @return its bytes; 0 where there is none.
  std::size_t receive(std::span<std::uint8_t> packet) const noexcept;
  std::size_t receive(std::span<std::uint8_t> packet, std::uint32_t& sender) const noexcept;

  /// Waits for a packet. @return false where none came.
  bool wait(std::chrono::milliseconds patience) const noexcept;

 private:
  UdpSocket();
  void bind_to(std::uint32_t local_address, std::uint16_t port) noexcept;

  int fd_;
  bool is_open_ = false;
};

}  // namespace striper::detail
