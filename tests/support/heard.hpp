// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include <gmock/gmock.h>

#include <striper/core/event.hpp>

namespace striper::testing {

/// Keeps the events that are sent to its port, from whatever thread.
class Heard {
 public:
  EventPort port() const {
    return EventPort([state = state_](const Event& event) {
      const std::lock_guard lock(state->mutex);
      state->events.push_back(event);
    });
  }
  std::vector<Event> events() const {
    const std::lock_guard lock(state_->mutex);
    return state_->events;
  }

 private:
  struct State {
    std::mutex mutex;
    std::vector<Event> events;
  };
  std::shared_ptr<State> state_ = std::make_shared<State>();
};

/// Matches events among which is one of a code.
inline auto has_event(EventCode code) {
  return ::testing::Contains(::testing::Field(&Event::code, code));
}

}  // namespace striper::testing
