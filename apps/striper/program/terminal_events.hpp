// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include <striper/ambient/ambient_status.hpp>
#include <striper/core/event.hpp>

namespace striper::program {

/// "warning: ...", with the advice on a line of its own.
std::string sentence(const Event& event);

/// "channel green", "pattern 0,dark (found)", "ambient fields": what was decided, and how many lit
/// exposures gave nothing. Empty before anything was decided.
std::vector<std::string> decisions(const AmbientStatus& status);

/// Says warnings and worse on the terminal, of each kind the first ten, and keeps all events.
/// Thread-safe.
class TerminalEvents {
 public:
  /// @param unsaid kinds that the program has words of its own for.
  explicit TerminalEvents(std::initializer_list<EventCode> unsaid = {});

  /// Keeps them and says nothing.
  static TerminalEvents silent();

  /// May outlive this object.
  EventPort port() const noexcept { return port_; }

  /// The first thousand of them, in order.
  std::vector<Event> heard() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
  EventPort port_;
};

}  // namespace striper::program
