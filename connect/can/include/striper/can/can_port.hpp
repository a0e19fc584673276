// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include <striper/core/uri.hpp>

namespace striper {

/// A classical CAN frame with an identifier of 11 bits.
struct CanFrame {
  std::uint32_t id = 0;
  std::uint8_t size = 0;  ///< Bytes of `data` that are sent, up to 8.
  std::array<std::uint8_t, 8> data{};
};

/// The address of where frames go: `can:INTERFACE`, a CAN interface of this machine, or
/// `candump:FILE`, a log as `candump -L` of can-utils writes it and `canplayer` plays it.
class CanUri : public Uri {
 public:
  /// @throws Error{kUsage} on another scheme, an empty name, or a key that is given twice.
  static CanUri parse(std::string_view text);
  /// Whether the address has one of the two schemes.
  static bool is_one(std::string_view text) noexcept;

 private:
  using Uri::Uri;
};

/// Where frames go.
class CanPort {
 public:
  virtual ~CanPort() = default;

  /// Hands a frame over, without waiting. What a full or broken bus does not take is lost and
  /// counted. @param time_s of the run; a log has it, a bus does not.
  virtual void send(double time_s, const CanFrame& frame) noexcept = 0;
  /// @throws Error{kIo} where a log could not be written.
  virtual void close() = 0;

  std::uint64_t sent() const noexcept { return sent_; }
  std::uint64_t lost() const noexcept { return lost_; }
  int last_error() const noexcept { return last_error_; }  ///< errno of the last loss; 0: none.

 protected:
  void count(int error) noexcept;  ///< 0: it was sent.

 private:
  std::uint64_t sent_ = 0;
  std::uint64_t lost_ = 0;
  int last_error_ = 0;
};

/// @throws Error{kUsage} for a key that nobody took, Error{kNotFound} naming the interface,
/// Error{kUnsupported} where the kernel has no CAN, Error{kIo}.
std::unique_ptr<CanPort> open_can_port(CanUri uri);

/// A line of a log: `(SECONDS.MICROSECONDS) INTERFACE ID#DATA`, hexadecimal.
void append_candump_line(std::string& out, double time_s, const CanFrame& frame);

}  // namespace striper
