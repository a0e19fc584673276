// SPDX-License-Identifier: Apache-2.0
#include "run/service.hpp"

#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

namespace striper::program {
namespace {

std::string variable(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): at the start.
  return value == nullptr ? "" : value;
}

long number(const std::string& text) {
  long value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

}  // namespace

Service::Service() : socket_(variable("NOTIFY_SOCKET")) {
  const std::string process = variable("WATCHDOG_PID");
  const long period_us = number(variable("WATCHDOG_USEC"));
  const bool is_ours = process.empty() || number(process) == static_cast<long>(::getpid());
  if (is_ours && period_us > 0) alive_every_ = std::chrono::microseconds(period_us / 2);
}

void Service::say_alive() {
  const auto now = std::chrono::steady_clock::now();
  if (!alive_every_ || now - last_alive_ < *alive_every_) return;
  last_alive_ = now;
  send("WATCHDOG=1");
}

// A name that begins with @ is in the abstract space, where a zero stands for it.
void Service::send(const std::string& message) const {
  sockaddr_un address{};
  if (socket_.empty() || socket_.size() >= sizeof address.sun_path) return;
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, socket_.data(), socket_.size());
  if (socket_.front() == '@') address.sun_path[0] = '\0';
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + socket_.size());
  const int out = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (out < 0) return;
  // Ten messages wait at most (net.unix.max_dgram_qlen). Who does not listen must not stop the
  // scans.
  constexpr timeval kPatience{0, 50'000};
  ::setsockopt(out, SOL_SOCKET, SO_SNDTIMEO, &kPatience, sizeof kPatience);
  [[maybe_unused]] const ssize_t ignored =
      ::sendto(out, message.data(), message.size(), MSG_NOSIGNAL,
               reinterpret_cast<const sockaddr*>(&address), size);
  ::close(out);
}

}  // namespace striper::program
