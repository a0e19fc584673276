// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include <striper/core/event.hpp>
#include <striper/gige/gige_options.hpp>

namespace striper {

/// A GenICam camera that answers.
struct GigeListing {
  std::string uri;       ///< What opens it.
  std::string protocol;  ///< `GigE Vision` or `USB3 Vision`.
  std::string maker;
  std::string model;
  std::string serial;
  std::string user_name;  ///< Empty if it has none.
  std::string mac;        ///< Empty for USB.
  std::string address;    ///< IP address, or where it is on the USB.
  std::string interface;  ///< Network interface; empty for USB.
  std::string access;     ///< `free`, `held by 10.0.0.5:4711`, `other subnet`, `unknown`.
};

/// Every GigE Vision and USB3 Vision camera, in half a second. Takes control of none. Never throws.
std::vector<GigeListing> list_gige_cameras();

/// Triggers every GigE Vision camera at once whose action keys fit (`trigger=Action`), whoever
/// controls it: broadcasts an action command on every network interface, once where several are of
/// one subnet, since a camera that heard it twice would expose twice.
/// @param cameras how many are to act: it returns when so many have answered.
/// @param patience until it returns in any case.
/// @return how many addresses answered that they act.
int trigger_gige_action(const ActionKeys& keys, int cameras = 1,
                        std::chrono::milliseconds patience = std::chrono::milliseconds(100));

/// Looks for what keeps a GigE Vision camera from being reached: nobody answers, another subnet,
/// filters in this machine, another program that holds it, small packets. Takes no control.
/// @param name as in `gige:NAME`.
std::vector<Event> examine_gige_network(const std::string& name);

/// Finds out why a camera that answers gives no frame: has it fire test packets and sees which
/// sizes arrive. Takes control of it for a moment.
/// @param packet_bytes the size that was agreed on, with IP and UDP headers; 0: not known.
std::vector<Event> examine_gige_stream(const std::string& name, int packet_bytes);

}  // namespace striper
