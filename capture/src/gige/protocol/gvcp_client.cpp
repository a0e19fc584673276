// SPDX-License-Identifier: Apache-2.0
#include "gige/protocol/gvcp_client.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <set>
#include <span>
#include <utility>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "gige/protocol/gvcp.hpp"
#include "gige/protocol/udp_socket.hpp"

namespace striper::detail {
namespace gvcp {

std::string to_string_ip(std::uint32_t address) {
  return fmt::format("{}.{}.{}.{}", address >> 24, (address >> 16) & 0xff, (address >> 8) & 0xff,
                     address & 0xff);
}

bool parse_ip(const std::string& text, std::uint32_t& address) {
  in_addr parsed{};
  if (inet_pton(AF_INET, text.c_str(), &parsed) != 1) return false;
  address = ntohl(parsed.s_addr);
  return true;
}

}  // namespace gvcp

namespace {

using Clock = std::chrono::steady_clock;
using Packet = std::array<std::uint8_t, 1024>;

// Cameras answer discovery with the request's own number, which must not be 0.
constexpr std::uint16_t kRequest = 0x5354;

sockaddr_in control_port_of(std::uint32_t address) { return socket_address(address, gvcp::kPort); }

/// A command with its content, all of which is words.
std::vector<std::uint8_t> command(std::uint16_t code,
                                  std::initializer_list<std::uint32_t> words = {},
                                  std::uint8_t flags = 0) {
  std::vector<std::uint8_t> bytes(gvcp::kHeaderBytes + 4 * words.size());
  bytes[0] = gvcp::kKey;
  bytes[1] = static_cast<std::uint8_t>(gvcp::kAckRequired | flags);
  gvcp::put16(&bytes[2], code);
  gvcp::put16(&bytes[4], static_cast<std::uint32_t>(4 * words.size()));
  gvcp::put16(&bytes[6], kRequest);
  std::uint8_t* at = bytes.data() + gvcp::kHeaderBytes;
  for (const std::uint32_t word : words) {
    gvcp::put32(at, word);
    at += 4;
  }
  return bytes;
}

bool is_answer(const Packet& packet, std::size_t size, std::uint16_t code) {
  return size >= gvcp::kHeaderBytes && gvcp::get16(&packet[2]) == code + 1 &&
         gvcp::get16(&packet[6]) == kRequest;
}

std::string fixed_text(const Packet& packet, std::size_t reg, std::size_t length) {
  const char* const text = reinterpret_cast<const char*>(&packet[gvcp::kHeaderBytes + reg]);
  return {text, strnlen(text, length)};
}

GvcpDevice parse_discovery(const Packet& packet, const NetworkInterface& where) {
  const std::uint8_t* const data = &packet[gvcp::kHeaderBytes];
  GvcpDevice device;
  device.address = gvcp::get32(data + gvcp::kCurrentIp);
  device.mask = gvcp::get32(data + gvcp::kCurrentMask);
  device.interface_address = where.address;
  device.interface_mask = where.mask;
  device.interface_name = where.name;
  const std::uint8_t* const mac = data + gvcp::kMacHigh + 2;
  device.mac = fmt::format("{:02x}:{:02x}:{:02x}:{:02x}:{:02x}:{:02x}", mac[0], mac[1], mac[2],
                           mac[3], mac[4], mac[5]);
  device.manufacturer = fixed_text(packet, gvcp::kManufacturer, 32);
  device.model = fixed_text(packet, gvcp::kModel, 32);
  device.serial = fixed_text(packet, gvcp::kSerial, 16);
  device.user_name = fixed_text(packet, gvcp::kUserName, 16);
  return device;
}

struct Asked {
  std::unique_ptr<UdpSocket> socket;
  NetworkInterface where;
};

/// Where an answer came in, and from whom.
struct Origin {
  const NetworkInterface& where;
  std::uint32_t sender = 0;
};

/// Calls `use(packet, size, origin)` for what comes in until the time is over or it returns
/// true.
template <typename Use>
void receive_until(const std::vector<Asked>& asked, std::chrono::milliseconds wait, Use use) {
  const auto end = Clock::now() + wait;
  std::vector<pollfd> waiting;
  waiting.reserve(asked.size());
  for (const Asked& a : asked) waiting.push_back({a.socket->fd(), POLLIN, 0});
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
    if (left.count() <= 0 || waiting.empty()) return;
    if (poll(waiting.data(), waiting.size(), static_cast<int>(left.count())) <= 0) continue;
    for (const Asked& a : asked) {
      Packet packet;
      std::uint32_t sender = 0;
      while (const std::size_t size = a.socket->receive(packet, sender)) {
        if (use(packet, size, Origin{a.where, sender})) return;
      }
    }
  }
}

/// Sends to everybody on these interfaces, and hears what answers.
std::vector<Asked> ask_everybody(std::span<const std::uint8_t> request,
                                 const std::vector<NetworkInterface>& interfaces) {
  std::vector<Asked> asked;
  for (const NetworkInterface& where : interfaces) {
    auto socket = std::make_unique<UdpSocket>(where.address);
    auto broadcast_socket = UdpSocket::for_broadcasts(*socket, where.name);
    if (socket->is_open() && socket->send(control_port_of(INADDR_BROADCAST), request)) {
      asked.push_back({std::move(socket), where});
      if (broadcast_socket->is_open()) asked.push_back({std::move(broadcast_socket), where});
    }
  }
  return asked;
}

/// A socket on every interface from which the address can be reached.
std::vector<Asked> sockets_towards(std::uint32_t address) {
  std::vector<Asked> asked;
  for (const NetworkInterface& where : network_interfaces()) {
    if ((where.address & where.mask) != (address & where.mask)) continue;
    auto socket = std::make_unique<UdpSocket>(where.address);
    if (socket->is_open()) asked.push_back({std::move(socket), where});
  }
  return asked;
}

}  // namespace

bool GvcpDevice::is_called(const std::string& name) const {
  return name.empty() || name == serial || name == user_name || name == mac || name == model ||
         name == manufacturer + "-" + serial || name == gvcp::to_string_ip(address);
}

std::vector<NetworkInterface> network_interfaces() {
  std::vector<NetworkInterface> result;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return result;
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  for (const ifaddrs* at = list; at != nullptr; at = at->ifa_next) {
    if (at->ifa_addr == nullptr || at->ifa_netmask == nullptr ||
        at->ifa_addr->sa_family != AF_INET || (at->ifa_flags & IFF_UP) == 0) {
      continue;
    }
    NetworkInterface one;
    one.name = at->ifa_name;
    one.address = ntohl(reinterpret_cast<const sockaddr_in*>(at->ifa_addr)->sin_addr.s_addr);
    one.mask = ntohl(reinterpret_cast<const sockaddr_in*>(at->ifa_netmask)->sin_addr.s_addr);
    ifreq request{};
    std::strncpy(request.ifr_name, at->ifa_name, IFNAMSIZ - 1);
    if (ioctl(fd, SIOCGIFMTU, &request) == 0) one.mtu = request.ifr_mtu;
    result.push_back(one);
  }
  if (fd >= 0) close(fd);
  freeifaddrs(list);
  return result;
}

std::vector<NetworkInterface> one_of_each_subnet(const std::vector<NetworkInterface>& interfaces) {
  std::vector<NetworkInterface> result;
  std::set<std::pair<std::uint32_t, std::uint32_t>> subnets;
  for (const NetworkInterface& one : interfaces) {
    if (subnets.emplace(one.address & one.mask, one.mask).second) result.push_back(one);
  }
  return result;
}

std::vector<GvcpDevice> discover(std::chrono::milliseconds wait,
                                 const std::function<bool(const GvcpDevice&)>& is_wanted) {
  // A camera of another subnet has no way back but to everybody.
  const std::vector<Asked> asked =
      ask_everybody(command(gvcp::kDiscovery, {}, gvcp::kMayBroadcastAnswer), network_interfaces());
  std::vector<GvcpDevice> found;
  receive_until(asked, wait, [&](const Packet& packet, std::size_t size, const Origin& from) {
    if (!is_answer(packet, size, gvcp::kDiscovery) ||
        size < gvcp::kHeaderBytes + gvcp::kDiscoveryEnd) {
      return false;
    }
    GvcpDevice device = parse_discovery(packet, from.where);
    const bool is_enough = is_wanted(device);
    const auto known = std::find_if(found.begin(), found.end(), [&](const GvcpDevice& other) {
      return other.mac == device.mac && other.address == device.address;
    });
    if (known == found.end()) {
      found.push_back(std::move(device));
    } else if (device.is_reachable()) {
      *known = std::move(device);  // an interface with several addresses: this one fits
    }
    return is_enough;
  });
  return found;
}

std::optional<GvcpDevice> discover_at(std::uint32_t address, std::chrono::milliseconds wait) {
  const std::vector<Asked> asked = sockets_towards(address);
  const auto request = command(gvcp::kDiscovery);
  for (const Asked& a : asked) a.socket->send(control_port_of(address), request);
  std::optional<GvcpDevice> found;
  receive_until(asked, wait, [&](const Packet& packet, std::size_t size, const Origin& from) {
    if (!is_answer(packet, size, gvcp::kDiscovery) ||
        size < gvcp::kHeaderBytes + gvcp::kDiscoveryEnd) {
      return false;
    }
    found = parse_discovery(packet, from.where);
    return true;
  });
  return found;
}

std::optional<std::uint32_t> read_register(std::uint32_t address, std::uint32_t reg,
                                           std::chrono::milliseconds wait) {
  const std::vector<Asked> asked = sockets_towards(address);
  const auto request = command(gvcp::kReadRegister, {reg});
  for (const Asked& a : asked) a.socket->send(control_port_of(address), request);
  std::optional<std::uint32_t> value;
  receive_until(asked, wait, [&](const Packet& packet, std::size_t size, const auto&) {
    if (!is_answer(packet, size, gvcp::kReadRegister)) return false;
    if (gvcp::get16(&packet[0]) == gvcp::kSuccess && size >= gvcp::kHeaderBytes + 4) {
      value = gvcp::get32(&packet[gvcp::kHeaderBytes]);
    }
    return true;
  });
  return value;
}

Access access_of(std::uint32_t address, std::chrono::milliseconds wait) {
  const auto privilege = read_register(address, gvcp::kControlPrivilege, wait);
  if (!privilege) return {};
  if ((*privilege & (gvcp::kControl | gvcp::kExclusive)) == 0) return {AccessState::kFree, {}};
  Access access{AccessState::kHeld, {}};
  const auto holder = read_register(address, gvcp::kPrimaryIp, wait);
  const auto port = read_register(address, gvcp::kPrimaryPort, wait);
  if (holder && port && *holder != 0) {
    access.holder = fmt::format("{}:{}", gvcp::to_string_ip(*holder), *port & 0xffff);
  }
  return access;
}

int send_action(const ActionKeys& keys, int cameras, std::chrono::milliseconds patience) {
  const std::vector<Asked> asked =
      ask_everybody(command(gvcp::kAction, {keys.device_key, keys.group_key, keys.group_mask}),
                    one_of_each_subnet(network_interfaces()));
  std::set<std::uint32_t> answered;
  receive_until(asked, patience, [&](const Packet& packet, std::size_t size, const Origin& from) {
    const bool acts =
        is_answer(packet, size, gvcp::kAction) && gvcp::get16(&packet[0]) == gvcp::kSuccess;
    if (acts) answered.insert(from.sender);
    return static_cast<int>(answered.size()) >= cameras;
  });
  return static_cast<int>(answered.size());
}

struct GvcpControl::Way {
  std::uint32_t address = 0;
  std::vector<Asked> asked;
};

GvcpControl::GvcpControl(const GvcpDevice& device) : way_(std::make_unique<Way>()) {
  way_->address = device.address;
  NetworkInterface where;
  where.name = device.interface_name;
  where.address = device.interface_address;
  auto socket = std::make_unique<UdpSocket>(where.address);
  if (socket->is_open()) way_->asked.push_back({std::move(socket), where});
  is_ours_ = write(gvcp::kControlPrivilege, gvcp::kControl);
}

GvcpControl::~GvcpControl() {
  if (is_ours_) write(gvcp::kControlPrivilege, 0);
}

bool GvcpControl::write(std::uint32_t reg, std::uint32_t value) {
  constexpr std::chrono::milliseconds kAnswerWithin{300};
  const auto request = command(gvcp::kWriteRegister, {reg, value});
  for (const Asked& a : way_->asked) a.socket->send(control_port_of(way_->address), request);
  bool is_taken = false;
  const auto take = [&](const Packet& packet, std::size_t size, const Origin&) {
    if (!is_answer(packet, size, gvcp::kWriteRegister)) return false;
    is_taken = gvcp::get16(&packet[0]) == gvcp::kSuccess;
    return true;
  };
  receive_until(way_->asked, kAnswerWithin, take);
  return is_taken;
}

}  // namespace striper::detail
