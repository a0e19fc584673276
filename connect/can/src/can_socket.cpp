// SPDX-License-Identifier: Apache-2.0
#include "can_socket.hpp"

#include <cerrno>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <striper/core/error.hpp>

namespace striper::detail {

CanSocketHandle::CanSocketHandle(std::string interface) : interface_(std::move(interface)) {
  socket_ = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (socket_ < 0) {
    const int error = errno;
    if (error == EAFNOSUPPORT || error == EPROTONOSUPPORT) {
      throw Error(
          ErrorKind::kUnsupported,
          fmt::format("can:{}: this kernel has no CAN; 'modprobe can_raw' where it is a module",
                      interface_));
    }
    fail(error);
  }
  try {
    bind();
  } catch (...) {
    ::close(socket_);
    throw;
  }
}

CanSocketHandle::~CanSocketHandle() { ::close(socket_); }

void CanSocketHandle::bind() const {
  ::setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FILTER, nullptr, 0);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(::if_nametoindex(interface_.c_str()));
  const bool is_there =
      address.can_ifindex != 0 &&
      ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  if (!is_there) {
    throw Error(
        ErrorKind::kNotFound,
        fmt::format("can:{0}: there is no CAN interface '{0}'; 'ip link' lists them", interface_));
  }
  // One that is down is bound all the same; the socket keeps that as an error.
  int error = 0;
  socklen_t size = sizeof error;
  ::getsockopt(socket_, SOL_SOCKET, SO_ERROR, &error, &size);
  if (error == ENETDOWN) {
    throw Error(ErrorKind::kIo,
                fmt::format("can:{0}: the interface is down; 'ip link set {0} up'", interface_));
  }
  if (error != 0) fail(error);
}

void CanSocketHandle::fail(int error) const {
  throw Error(ErrorKind::kIo,
              fmt::format("can:{}: {}", interface_, std::generic_category().message(error)));
}

}  // namespace striper::detail
