// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace striper::program {

enum class MessageLevel { kInformation, kWarning, kError };

/// `information`, `warning`, `error`. Static storage.
std::string_view to_string(MessageLevel level) noexcept;

/// What the console says to its operator: the newest message, which goes away by itself, the worse
/// the later.
class MessageBoard {
 public:
  struct Message {
    MessageLevel level = MessageLevel::kInformation;
    std::string text;
  };

  void say(MessageLevel level, std::string text, double now_s);
  /// What stands now; nothing once its time is over.
  const Message* shown(double now_s) const noexcept;

  /// How long each level stands: long enough to read a line, twice, or to be called to the screen.
  static double stands_s(MessageLevel level) noexcept;

 private:
  std::optional<Message> message_;
  double until_s_ = 0.0;
};

}  // namespace striper::program
