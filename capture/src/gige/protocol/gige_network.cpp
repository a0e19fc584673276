// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/gige/gige_network.hpp>

#include "gige/protocol/arv_ptr.hpp"
#include "gige/protocol/gvcp.hpp"
#include "gige/protocol/gvcp_client.hpp"
#include "gige/protocol/reverse_path.hpp"
#include "gige/protocol/stream_path.hpp"

namespace striper {
namespace {

using namespace std::chrono_literals;
using detail::GvcpDevice;
using detail::NetworkInterface;
constexpr auto kAnswerWithin = 500ms;
constexpr int kJumboMtu = 8000;
constexpr int kSmallestPacket = 576;
constexpr int kUsualPacket = 1400;

std::string ip(std::uint32_t address) { return detail::gvcp::to_string_ip(address); }

std::string access_text(const GvcpDevice& device) {
  if (!device.is_reachable()) return "other subnet";
  const detail::Access access = detail::access_of(device.address, kAnswerWithin);
  switch (access.state) {
    case detail::AccessState::kFree:
      return "free";
    case detail::AccessState::kHeld:
      return access.holder.empty() ? "held" : "held by " + access.holder;
    case detail::AccessState::kSilent:
      break;
  }
  return "unknown";
}

GigeListing listing_of(const GvcpDevice& device) {
  GigeListing one;
  one.uri = "gige:" + (device.serial.empty() ? ip(device.address) : device.serial);
  one.protocol = "GigE Vision";
  one.maker = device.manufacturer;
  one.model = device.model;
  one.serial = device.serial;
  one.user_name = device.user_name;
  one.mac = device.mac;
  one.address = ip(device.address);
  one.interface = device.interface_name;
  one.access = access_text(device);
  return one;
}

void add_usb_cameras(std::vector<GigeListing>& listings) {
  ArvInterface* const usb = arv_uv_interface_get_instance();
  arv_interface_update_device_list(usb);
  const auto text = [](const char* value) { return std::string(value != nullptr ? value : ""); };
  for (unsigned i = 0; i < arv_interface_get_n_devices(usb); ++i) {
    GigeListing one;
    one.protocol = "USB3 Vision";
    one.maker = text(arv_interface_get_device_vendor(usb, i));
    one.model = text(arv_interface_get_device_model(usb, i));
    one.serial = text(arv_interface_get_device_serial_nbr(usb, i));
    one.address = text(arv_interface_get_device_address(usb, i));
    one.uri =
        "u3v:" + (one.serial.empty() ? text(arv_interface_get_device_id(usb, i)) : one.serial);
    one.access = "unknown";
    listings.push_back(one);
  }
}

Event answers_filtered(std::uint64_t count, const std::vector<NetworkInterface>& interfaces) {
  std::vector<std::string> cures;
  for (const NetworkInterface& one : interfaces) {
    if (one.name == "lo" || !detail::filters_by_reverse_path(one.name)) continue;
    cures.push_back(fmt::format("`sysctl -w net.ipv4.conf.{}.rp_filter=2`", one.name));
  }
  return {"answers_filtered",
          fmt::format("somebody answered and the reverse-path filter of this machine threw {} "
                      "packet{} away: a camera of another subnet, very likely",
                      count, count == 1 ? "" : "s"),
          fmt::format("{} lets its answer in; then give it an address of this subnet",
                      fmt::join(cures, ", "))};
}

Event nobody_answers(const std::vector<NetworkInterface>& interfaces) {
  std::vector<std::string> asked;
  asked.reserve(interfaces.size());
  for (const NetworkInterface& one : interfaces) {
    asked.push_back(fmt::format("{} ({})", one.name, ip(one.address)));
  }
  std::string cure =
      "is the camera powered and plugged into one of these? Does the link light glow? A firewall "
      "drops the answers unless UDP from port 3956 is let in (nft: `udp sport 3956 accept`)";
  // A strict filter answers no ARP of another subnet: then there is no packet to be counted.
  for (const NetworkInterface& one : interfaces) {
    if (one.name == "lo" || !detail::filters_by_reverse_path(one.name)) continue;
    cure += fmt::format(
        "; {0} filters by reverse path: `sysctl -w net.ipv4.conf.{0}.rp_filter=2` shows a camera "
        "of another subnet",
        one.name);
  }
  return {"camera_not_found", fmt::format("no camera answers; asked on {}", fmt::join(asked, ", ")),
          cure};
}

Event not_that_one(const std::string& name, const std::vector<GvcpDevice>& present) {
  std::vector<std::string> there;
  there.reserve(present.size());
  for (const GvcpDevice& one : present) {
    there.push_back(fmt::format("{} at {}", one.serial, ip(one.address)));
  }
  return {"camera_not_found",
          fmt::format("no camera '{}'; there are {}", name, fmt::join(there, ", ")),
          "name one of these"};
}

void examine_camera(const GvcpDevice& device, const std::vector<NetworkInterface>& interfaces,
                    std::vector<Event>& findings) {
  findings.push_back({"camera_found",
                      fmt::format("{} {} {} answers at {} on {}", device.manufacturer, device.model,
                                  device.serial, ip(device.address), device.interface_name),
                      ""});
  if (!device.is_reachable()) {
    findings.push_back(
        {"camera_other_subnet",
         fmt::format("wrong subnet: the camera is {}, {} is {}/{}", ip(device.address),
                     device.interface_name, ip(device.interface_address),
                     ip(device.interface_mask)),
         fmt::format("`ip addr add {}/24 dev {}`, or give the camera an address of {}'s subnet",
                     ip((device.address & 0xffffff00) | 254), device.interface_name,
                     device.interface_name)});
    return;
  }
  const detail::Access access = detail::access_of(device.address, kAnswerWithin);
  if (access.state == detail::AccessState::kHeld) {
    findings.push_back(
        {"camera_held",
         fmt::format("held by another program{}",
                     access.holder.empty() ? "" : " (" + access.holder + ")"),
         "stop that program; one that died lets go after the heartbeat time, 3 s or so"});
  } else if (access.state == detail::AccessState::kFree) {
    findings.push_back({"camera_free", "free to be opened", ""});
  } else {
    findings.push_back({"camera_access_unknown", "does not tell whether it is held", ""});
  }
  for (const NetworkInterface& one : interfaces) {
    if (one.name != device.interface_name || one.mtu >= kJumboMtu) continue;
    findings.push_back(
        {"packets_small", fmt::format("MTU of {} is {}: many small packets", one.name, one.mtu),
         fmt::format("`ip link set {} mtu 9000`, where camera and switch can", one.name)});
    break;  // an interface with several addresses is one
  }
}

Event conclude_path(const std::vector<int>& arrived, int wanted) {
  if (arrived.empty()) {
    return {"stream_blocked",
            "the camera answers, and none of its test packets arrives (or it can send none)",
            "a firewall drops them: let UDP in that comes from the camera's address (nft: `ip "
            "saddr ADDRESS udp sport != 3956 accept`)"};
  }
  if (std::find(arrived.begin(), arrived.end(), wanted) == arrived.end()) {
    const int largest = *std::max_element(arrived.begin(), arrived.end());
    return {"stream_blocked",
            fmt::format("the MTU is too small on the way: packets of {} bytes arrive, those of {} "
                        "do not",
                        largest, wanted),
            fmt::format("packet_size={}, or without packet_size= the largest that arrives is "
                        "found; or raise the MTU of the interface and of every switch",
                        largest)};
  }
  return {"camera_silent", "test packets arrive and frames do not: the camera gives none",
          "a trigger that never comes: look at trigger= and its wiring, or try trigger=off"};
}

}  // namespace

int trigger_gige_action(const ActionKeys& keys, int cameras, std::chrono::milliseconds patience) {
  return detail::send_action(keys, cameras, patience);
}

std::vector<GigeListing> list_gige_cameras() {
  std::vector<GigeListing> listings;
  for (const GvcpDevice& device : detail::discover(kAnswerWithin)) {
    listings.push_back(listing_of(device));
  }
  add_usb_cameras(listings);
  return listings;
}

std::vector<Event> examine_gige_network(const std::string& name) {
  std::vector<Event> findings;
  const std::vector<NetworkInterface> interfaces = detail::network_interfaces();
  const std::uint64_t drops_before = detail::reverse_path_drops();
  const std::vector<GvcpDevice> present = detail::discover(kAnswerWithin);
  const std::uint64_t drops = detail::reverse_path_drops() - drops_before;
  const auto found = std::find_if(present.begin(), present.end(),
                                  [&](const GvcpDevice& device) { return device.is_called(name); });
  if (found != present.end()) {
    examine_camera(*found, interfaces, findings);
  } else if (drops > 0) {
    findings.push_back(answers_filtered(drops, interfaces));
  } else if (present.empty()) {
    findings.push_back(nobody_answers(interfaces));
  } else {
    findings.push_back(not_that_one(name, present));
  }
  return findings;
}

std::vector<Event> examine_gige_stream(const std::string& name, int packet_bytes) {
  std::optional<GvcpDevice> camera;
  for (GvcpDevice& device : detail::discover(kAnswerWithin)) {
    if (!camera && device.is_called(name) && device.is_reachable()) camera = std::move(device);
  }
  if (!camera) return {};
  const int wanted = packet_bytes > 0 ? packet_bytes : kUsualPacket;
  const auto arrived = detail::sizes_that_arrive(*camera, {kSmallestPacket, kUsualPacket, wanted});
  if (!arrived) return {};
  return {conclude_path(*arrived, wanted)};
}

}  // namespace striper
