// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <striper/core/event.hpp>

namespace striper::detail {

/// Sends events of a stream; what stays as it is is said once.
class OnceEvents {
 public:
  explicit OnceEvents(EventPort port) : port_(std::move(port)) {}

  void send(EventCode code, const std::string& message) { port_.send({code, message}); }

  void send_once(Event event) {
    if (std::find(said_.begin(), said_.end(), event.code) != said_.end()) return;
    said_.push_back(event.code);
    port_.send(std::move(event));
  }

 private:
  EventPort port_;
  std::vector<EventCode> said_;
};

}  // namespace striper::detail
