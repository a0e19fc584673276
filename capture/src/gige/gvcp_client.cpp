// SPDX-License-Identifier: Apache-2.0
#include "gige/gvcp_client.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "gige/gvcp.hpp"

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

sockaddr_in socket_address(std::uint32_t address, std::uint16_t port) {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_port = htons(port);
  result.sin_addr.s_addr = htonl(address);
  return result;
}

class UdpSocket {
 public:
  explicit UdpSocket(std::uint32_t local_address) : UdpSocket() { bind_to(local_address, 0); }

  /// Hears what is broadcast to the port of another socket, on one interface. (One that has an
  /// address hears only what is sent to that.) Not open where the kernel does not let it.
  static std::unique_ptr<UdpSocket> for_broadcasts(const UdpSocket& to,
                                                   const std::string& interface) {
    auto result = std::unique_ptr<UdpSocket>(new UdpSocket());
    const auto length = static_cast<socklen_t>(interface.size());
    if (setsockopt(result->fd_, SOL_SOCKET, SO_BINDTODEVICE, interface.data(), length) == 0) {
      result->bind_to(INADDR_ANY, to.port());
    }
    return result;
  }
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;
  ~UdpSocket() {
    if (fd_ >= 0) close(fd_);
  }

  int fd() const noexcept { return fd_; }
  bool is_open() const noexcept { return is_open_; }

  std::uint16_t port() const {
    sockaddr_in local{};
    socklen_t length = sizeof(local);
    getsockname(fd_, reinterpret_cast<sockaddr*>(&local), &length);
    return ntohs(local.sin_port);
  }

  bool send(std::uint32_t address, const std::uint8_t* data, std::size_t size) const {
    const sockaddr_in to = socket_address(address, gvcp::kPort);
    return sendto(fd_, data, size, 0, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) ==
           static_cast<ssize_t>(size);
  }

  /// Bytes received; 0 where there is nothing.
  std::size_t receive(Packet& packet) const {
    const ssize_t got = recv(fd_, packet.data(), packet.size(), 0);
    return got > 0 ? static_cast<std::size_t>(got) : 0;
  }

 private:
  UdpSocket() : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    const int yes = 1;
    setsockopt(fd_, SOL_SOCKET, SO_BROADCAST, &yes, sizeof(yes));
    setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  }
  void bind_to(std::uint32_t local_address, std::uint16_t port) {
    const sockaddr_in local = socket_address(local_address, port);
    is_open_ = fd_ >= 0 && bind(fd_, reinterpret_cast<const sockaddr*>(&local), sizeof(local)) == 0;
  }

  int fd_;
  bool is_open_ = false;
};

std::array<std::uint8_t, gvcp::kHeaderBytes> header(std::uint16_t command, std::size_t size,
                                                    std::uint8_t flags = 0) {
  std::array<std::uint8_t, gvcp::kHeaderBytes> bytes{
      gvcp::kKey, static_cast<std::uint8_t>(gvcp::kAckRequired | flags)};
  gvcp::put16(&bytes[2], command);
  gvcp::put16(&bytes[4], static_cast<std::uint32_t>(size));
  gvcp::put16(&bytes[6], kRequest);
  return bytes;
}

bool is_answer(const Packet& packet, std::size_t size, std::uint16_t command) {
  return size >= gvcp::kHeaderBytes && gvcp::get16(&packet[2]) == command + 1 &&
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

/// Calls `use(packet, size, interface)` for what comes in until the time is over or it returns
/// true.
template <typename Use>
void receive_until(const std::vector<Asked>& asked, std::chrono::milliseconds wait, Use use) {
  const auto end = Clock::now() + wait;
  std::vector<pollfd> waiting;
  for (const Asked& a : asked) waiting.push_back({a.socket->fd(), POLLIN, 0});
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
    if (left.count() <= 0 || waiting.empty()) return;
    if (poll(waiting.data(), waiting.size(), static_cast<int>(left.count())) <= 0) continue;
    for (const Asked& a : asked) {
      Packet packet;
      while (const std::size_t size = a.socket->receive(packet)) {
        if (use(packet, size, a.where)) return;
      }
    }
  }
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

std::vector<GvcpDevice> discover(std::chrono::milliseconds wait,
                                 const std::function<bool(const GvcpDevice&)>& is_wanted) {
  std::vector<Asked> asked;
  // A camera of another subnet has no way back but to everybody.
  const auto request = header(gvcp::kDiscovery, 0, gvcp::kMayBroadcastAnswer);
  for (const NetworkInterface& where : network_interfaces()) {
    auto socket = std::make_unique<UdpSocket>(where.address);
    auto ears = UdpSocket::for_broadcasts(*socket, where.name);
    if (socket->is_open() && socket->send(INADDR_BROADCAST, request.data(), request.size())) {
      asked.push_back({std::move(socket), where});
      if (ears->is_open()) asked.push_back({std::move(ears), where});
    }
  }
  std::vector<GvcpDevice> found;
  receive_until(asked, wait, [&](const Packet& packet, std::size_t size, const auto& where) {
    if (!is_answer(packet, size, gvcp::kDiscovery) ||
        size < gvcp::kHeaderBytes + gvcp::kDiscoveryEnd) {
      return false;
    }
    GvcpDevice device = parse_discovery(packet, where);
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
  const auto request = header(gvcp::kDiscovery, 0);
  for (const Asked& a : asked) a.socket->send(address, request.data(), request.size());
  std::optional<GvcpDevice> found;
  receive_until(asked, wait, [&](const Packet& packet, std::size_t size, const auto& where) {
    if (!is_answer(packet, size, gvcp::kDiscovery) ||
        size < gvcp::kHeaderBytes + gvcp::kDiscoveryEnd) {
      return false;
    }
    found = parse_discovery(packet, where);
    return true;
  });
  return found;
}

std::optional<std::uint32_t> read_register(std::uint32_t address, std::uint32_t reg,
                                           std::chrono::milliseconds wait) {
  const std::vector<Asked> asked = sockets_towards(address);
  std::array<std::uint8_t, gvcp::kHeaderBytes + 4> request{};
  const auto head = header(gvcp::kReadRegister, 4);
  std::copy(head.begin(), head.end(), request.begin());
  gvcp::put32(&request[gvcp::kHeaderBytes], reg);
  for (const Asked& a : asked) a.socket->send(address, request.data(), request.size());
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
  std::array<std::uint8_t, gvcp::kHeaderBytes + 8> request{};
  const auto head = header(gvcp::kWriteRegister, 8);
  std::copy(head.begin(), head.end(), request.begin());
  gvcp::put32(&request[gvcp::kHeaderBytes], reg);
  gvcp::put32(&request[gvcp::kHeaderBytes + 4], value);
  for (const Asked& a : way_->asked) a.socket->send(way_->address, request.data(), request.size());
  bool is_taken = false;
  const auto take = [&](const Packet& packet, std::size_t size, const NetworkInterface&) {
    if (!is_answer(packet, size, gvcp::kWriteRegister)) return false;
    is_taken = gvcp::get16(&packet[0]) == gvcp::kSuccess;
    return true;
  };
  receive_until(way_->asked, kAnswerWithin, take);
  return is_taken;
}

}  // namespace striper::detail
