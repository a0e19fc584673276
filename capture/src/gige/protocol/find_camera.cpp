// SPDX-License-Identifier: Apache-2.0
#include "gige/protocol/find_camera.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/core/error.hpp>

#include "gige/protocol/gvcp.hpp"

namespace striper::detail {
namespace {

using namespace std::chrono_literals;

constexpr auto kAnswerWithin = 500ms;

GPtr<GInetAddress> inet_address(std::uint32_t address) {
  std::array<guint8, 4> bytes{};
  gvcp::put32(bytes.data(), address);
  return GPtr<GInetAddress>(g_inet_address_new_from_bytes(bytes.data(), G_SOCKET_FAMILY_IPV4));
}

std::string describe(const GvcpDevice& device) {
  return fmt::format("{} {} {}", device.manufacturer, device.model, device.serial);
}

GvcpDevice find_at(std::uint32_t address, const std::string& name) {
  if (auto device = discover_at(address, kAnswerWithin)) return *device;
  throw Error(ErrorKind::kNotFound,
              fmt::format("source 'gige:{}': no camera answers at this address; `striper doctor "
                          "gige:{}` looks for the reason",
                          name, name));
}

[[noreturn]] void refuse_held(const std::string& name, std::uint32_t address) {
  const Access access = access_of(address, kAnswerWithin);
  throw Error(ErrorKind::kDevice,
              fmt::format("camera {} is busy: held by another program{}; stop that one first", name,
                          access.holder.empty() ? "" : " (" + access.holder + ")"));
}

OpenCamera open_gige(const GigeOptions& options) {
  const GvcpDevice found = find_gige(options.name);
  const std::string description = describe(found);
  if (access_of(found.address, kAnswerWithin).state == AccessState::kHeld) {
    refuse_held(description, found.address);
  }
  CallError error;
  const GPtr<ArvDevice> device(arv_gv_device_new(inet_address(found.interface_address).get(),
                                                 inet_address(found.address).get(), error.slot()));
  if (!device || error) {
    throw Error(ErrorKind::kDevice,
                fmt::format("camera {}: cannot be opened: {}", description, error.message()));
  }
  if (arv_gv_device_is_controller(ARV_GV_DEVICE(device.get())) == FALSE) {
    refuse_held(description, found.address);
  }
  GPtr<ArvCamera> camera(arv_camera_new_with_device(device.get(), error.slot()));
  if (!camera || error) {
    throw Error(ErrorKind::kDevice, fmt::format("camera {}: its GenICam description is refused: {}",
                                                description, error.message()));
  }
  return {std::move(camera), found.address, description};
}

OpenCamera open_usb(const GigeOptions& options) {
  ArvInterface* const usb = arv_uv_interface_get_instance();
  arv_interface_update_device_list(usb);
  std::vector<std::string> present;
  for (unsigned i = 0; i < arv_interface_get_n_devices(usb); ++i) {
    const auto text = [](const char* value) { return std::string(value != nullptr ? value : ""); };
    const std::string id = text(arv_interface_get_device_id(usb, i));
    const std::array names{id, text(arv_interface_get_device_serial_nbr(usb, i)),
                           text(arv_interface_get_device_model(usb, i)),
                           text(arv_interface_get_device_physical_id(usb, i))};
    present.push_back(id);
    if (!options.name.empty() &&
        std::find(names.begin(), names.end(), options.name) == names.end()) {
      continue;
    }
    CallError error;
    const GPtr<ArvDevice> device(arv_interface_open_device(usb, id.c_str(), error.slot()));
    if (!device || error) {
      throw Error(ErrorKind::kDevice,
                  fmt::format("camera {}: cannot be opened: {} (held by another program, or no "
                              "permission: see the udev rules of your camera's maker)",
                              id, error.message()));
    }
    GPtr<ArvCamera> camera(arv_camera_new_with_device(device.get(), error.slot()));
    if (!camera || error) {
      throw Error(
          ErrorKind::kDevice,
          fmt::format("camera {}: its GenICam description is refused: {}", id, error.message()));
    }
    return {std::move(camera), 0, id};
  }
  throw Error(
      ErrorKind::kNotFound,
      fmt::format("source '{}': no such USB3 Vision camera; there {}", options.uri,
                  present.empty() ? "is none" : fmt::format("are {}", fmt::join(present, ", "))));
}

}  // namespace

GvcpDevice find_gige(const std::string& name) {
  std::uint32_t address = 0;
  if (gvcp::parse_ip(name, address)) return find_at(address, name);

  // One that answers on an interface with several addresses may be reached from another of these.
  const auto is_at_hand = [&](const GvcpDevice& device) {
    return device.is_called(name) && device.is_reachable();
  };
  const std::vector<GvcpDevice> present = discover(kAnswerWithin, is_at_hand);
  auto found = std::find_if(present.begin(), present.end(), is_at_hand);
  if (found == present.end()) {
    found = std::find_if(present.begin(), present.end(),
                         [&](const GvcpDevice& device) { return device.is_called(name); });
  }
  if (found == present.end()) {
    std::vector<std::string> serials;
    serials.reserve(present.size());
    for (const GvcpDevice& device : present) serials.push_back(device.serial);
    throw Error(ErrorKind::kNotFound,
                fmt::format("source 'gige:{}': no such camera; {}; `striper doctor gige:{}` looks "
                            "for the reason",
                            name,
                            present.empty() ? "none answers"
                                            : fmt::format("there are {}", fmt::join(serials, ", ")),
                            name));
  }
  if (!found->is_reachable()) {
    throw Error(
        ErrorKind::kDevice,
        fmt::format("camera {}: its address {} is of another subnet than {} on {}; give one "
                    "of them an address of the other's subnet",
                    describe(*found), gvcp::to_string_ip(found->address),
                    gvcp::to_string_ip(found->interface_address), found->interface_name));
  }
  return *found;
}

OpenCamera open_camera(const GigeOptions& options) {
  return options.is_usb ? open_usb(options) : open_gige(options);
}

}  // namespace striper::detail
