// SPDX-License-Identifier: Apache-2.0
#include "multicast_exam.hpp"

#include <array>
#include <cstring>
#include <string_view>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

namespace striper::detail {
namespace {

constexpr std::string_view kWord = "striper doctor";  // No RTPS message begins so.
constexpr int kWait_ms = 300;                         // It has to come back to this machine only.

class Socket {
 public:
  Socket() : file_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() { ::close(file_); }

  int file() const noexcept { return file_; }

  template <typename Value>
  bool set(int level, int option, const Value& value) const {
    return ::setsockopt(file_, level, option, &value, sizeof value) == 0;
  }

 private:
  int file_;
};

// Flags of an interface; 0: there is none of that name.
int flags_of(const Socket& socket, const std::string& interface) {
  ifreq request{};
  if (interface.size() >= sizeof request.ifr_name) return 0;
  std::memcpy(request.ifr_name, interface.data(), interface.size());
  return ::ioctl(socket.file(), SIOCGIFFLAGS, &request) == 0 ? request.ifr_flags : 0;
}

bool has_address(const Socket& socket, const std::string& interface) {
  ifreq request{};
  std::memcpy(request.ifr_name, interface.data(), interface.size());
  return ::ioctl(socket.file(), SIOCGIFADDR, &request) == 0;
}

// Sends a packet to the domain's group and waits for it to come back, as those of others would
// come.
bool hears_itself(const std::string& interface, std::uint32_t domain) {
  const Socket in, out;
  ip_mreqn group{};
  ::inet_pton(AF_INET, "239.255.0.1", &group.imr_multiaddr);
  group.imr_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(discovery_port(domain));
  address.sin_addr = group.imr_multiaddr;
  const int yes = 1;
  const bool is_set =
      in.set(SOL_SOCKET, SO_REUSEADDR, yes) && in.set(SOL_SOCKET, SO_REUSEPORT, yes);
  const auto* to = reinterpret_cast<const sockaddr*>(&address);
  if (!is_set || ::bind(in.file(), to, sizeof address) != 0) return false;
  if (!in.set(IPPROTO_IP, IP_ADD_MEMBERSHIP, group)) return false;
  if (!out.set(IPPROTO_IP, IP_MULTICAST_IF, group)) return false;
  if (::sendto(out.file(), kWord.data(), kWord.size(), 0, to, sizeof address) < 0) return false;
  std::array<char, 2048> got{};
  pollfd wait{in.file(), POLLIN, 0};
  while (::poll(&wait, 1, kWait_ms) > 0) {  // Others' packets come here too.
    const ssize_t size = ::recv(in.file(), got.data(), got.size(), 0);
    if (size >= 0 && std::string_view(got.data(), static_cast<std::size_t>(size)) == kWord)
      return true;
  }
  return false;
}

Event unfit(std::string what, std::string advice) {
  return {"interface_unfit", std::move(what), std::move(advice)};
}

}  // namespace

std::vector<Event> examine_interface(const std::string& interface, std::uint32_t domain) {
  const Socket socket;
  const int flags = flags_of(socket, interface);
  if (flags == 0) {
    return {unfit(fmt::format("there is no interface {}", interface), "`ip address` lists them")};
  }
  if ((flags & IFF_UP) == 0 || !has_address(socket, interface)) {
    return {unfit(fmt::format("interface {} is down, or has no IPv4 address", interface),
                  fmt::format("`ip link set {} up`, `ip address add ...`", interface))};
  }
  if (interface == "lo") return {};  // There programs ask each other one by one.
  if ((flags & IFF_MULTICAST) == 0) {
    return {unfit(
        fmt::format("interface {} has no multicast, by which programs find each other", interface),
        fmt::format("`ip link set {} multicast on`, or another interface", interface))};
  }
  if (hears_itself(interface, domain)) return {};
  return {unfit(
      fmt::format("what is sent to all programs of domain {} does not come back on interface {}",
                  domain, interface),
      fmt::format("a firewall: let UDP pass to ports {} and up, and IGMP; two programs that claim "
                  "the port for themselves; a VPN that takes the route",
                  discovery_port(domain)))};
}

}  // namespace striper::detail
