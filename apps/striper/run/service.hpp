// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

namespace striper::program {

/// Tells systemd how a service is: a datagram to the socket that NOTIFY_SOCKET names
/// (sd_notify(3)); without that, nothing. Not thread-safe.
class Service {
 public:
  Service();

  void say_ready() const { send("READY=1"); }
  void say_stopping() const { send("STOPPING=1"); }
  /// A line for `systemctl status`.
  void say_status(std::string_view status) const { send("STATUS=" + std::string(status)); }
  /// Twice as often as the watchdog wants (WATCHDOG_USEC), where it wants it of this process.
  void say_alive();

 private:
  void send(const std::string& message) const;

  std::string socket_;
  std::optional<std::chrono::steady_clock::duration> alive_every_;
  std::chrono::steady_clock::time_point last_alive_;
};

}  // namespace striper::program
