// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <striper/gige/gige_options.hpp>

namespace striper::detail {

/// What a GigE Vision camera says of itself when it is discovered.
struct GvcpDevice {
  std::uint32_t address = 0;
  std::uint32_t mask = 0;
  std::uint32_t interface_address = 0;  ///< Of this machine, where the answer came in.
  std::uint32_t interface_mask = 0;
  std::string interface_name;
  std::string mac;  ///< `02:00:7f:00:00:01`
  std::string manufacturer;
  std::string model;
  std::string serial;
  std::string user_name;

  /// False where the camera's address is of another subnet than the interface: it answers a
  /// broadcast and cannot be spoken to.
  bool is_reachable() const noexcept {
    return (address & interface_mask) == (interface_address & interface_mask);
  }

  /// Whether `gige:NAME` means this one: its serial, user name, MAC, model, `maker-serial` or
  /// address; an empty name means any.
  bool is_called(const std::string& name) const;
};

/// An IPv4 interface of this machine that is up.
struct NetworkInterface {
  std::string name;
  std::uint32_t address = 0;
  std::uint32_t mask = 0;
  int mtu = 0;
};

std::vector<NetworkInterface> network_interfaces();

/// The first of those that share a subnet: what is said to everybody on it is said once.
std::vector<NetworkInterface> one_of_each_subnet(const std::vector<NetworkInterface>& interfaces);

/// Asks on every interface who is there, and waits, or only until `is_wanted` is true of one that
/// answers. Never throws: an interface that cannot be asked is left out.
std::vector<GvcpDevice> discover(
    std::chrono::milliseconds wait, const std::function<bool(const GvcpDevice&)>& is_wanted =
                                        [](const GvcpDevice&) { return false; });

/// Asks one address. Empty where nothing answers.
std::optional<GvcpDevice> discover_at(std::uint32_t address, std::chrono::milliseconds wait);

/// Reads one register without taking control.
/// @return empty where nothing answers or the read is refused.
std::optional<std::uint32_t> read_register(std::uint32_t address, std::uint32_t reg,
                                           std::chrono::milliseconds wait);

/// `trigger_gige_action`.
int send_action(const ActionKeys& keys, int cameras, std::chrono::milliseconds patience);

/// Who holds a camera.
enum class AccessState {
  kFree,
  kHeld,    ///< Another program controls it.
  kSilent,  ///< It does not answer.
};
struct Access {
  AccessState state = AccessState::kSilent;
  std::string holder;  ///< `192.168.1.20:51234` where the camera tells.
};
Access access_of(std::uint32_t address, std::chrono::milliseconds wait);

/// Control of a camera for a moment, without Aravis: taken in the constructor if it is free, given
/// back in the destructor. Longer than the camera's heartbeat time it does not last.
class GvcpControl {
 public:
  explicit GvcpControl(const GvcpDevice& device);
  GvcpControl(const GvcpControl&) = delete;
  GvcpControl& operator=(const GvcpControl&) = delete;
  ~GvcpControl();

  bool is_ours() const noexcept { return is_ours_; }

  /// @return whether the camera took it.
  bool write(std::uint32_t reg, std::uint32_t value);

 private:
  struct Way;
  std::unique_ptr<Way> way_;
  bool is_ours_ = false;
};

}  // namespace striper::detail
