// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace striper::detail {

/// A raw CAN socket at one interface, closed with it.
class CanSocketHandle {
 public:
  /// Opens it, without frames to hear. @throws Error{kUnsupported, kNotFound, kIo} naming the
  /// interface and what to do.
  explicit CanSocketHandle(std::string interface);
  CanSocketHandle(const CanSocketHandle&) = delete;
  CanSocketHandle& operator=(const CanSocketHandle&) = delete;
  ~CanSocketHandle();

  int get() const noexcept { return socket_; }

 private:
  void bind() const;
  [[noreturn]] void fail(int error) const;

  std::string interface_;
  int socket_ = -1;
};

}  // namespace striper::detail
