// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cmath>
#include <mutex>
#include <utility>

#include <striper/core/event.hpp>

namespace striper {

std::string_view to_string(Severity severity) noexcept {
  switch (severity) {
    case Severity::kWarning:
      return "warning";
    case Severity::kError:
      return "error";
    case Severity::kRefusal:
      return "refusal";
    case Severity::kInfo:
      break;
  }
  return "info";
}

Event::Event(EventCode code_in, std::string message_in, std::string advice_in)
    : Event(code_in.kind().severity, code_in, std::move(message_in), std::move(advice_in)) {}

Event::Event(Severity severity_in, EventCode code_in, std::string message_in, std::string advice_in)
    : severity(severity_in),
      code(code_in),
      message(std::move(message_in)),
      advice(std::move(advice_in)) {}

struct EventPort::Shared {
  std::mutex mutex;
  EventHandler handler;
};

EventPort::EventPort(EventHandler handler) : shared_(std::make_shared<Shared>()) {
  shared_->handler = std::move(handler);
}

void EventPort::send(Event event) const noexcept {
  if (!shared_ || !shared_->handler) return;
  try {
    if (std::isnan(event.time_s)) {
      const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
      event.time_s = std::chrono::duration<double>(since_1970).count();
    }
    const std::lock_guard lock(shared_->mutex);
    shared_->handler(event);
  } catch (...) {  // Nobody is left to tell.
  }
}

EventPort EventPort::of_head(std::string head) const {
  return EventPort([port = *this, head = std::move(head)](Event event) {
    event.head = head;
    port.send(std::move(event));
  });
}

}  // namespace striper
