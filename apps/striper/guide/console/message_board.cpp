// SPDX-License-Identifier: Apache-2.0
#include "guide/console/message_board.hpp"

#include <utility>

namespace striper::program {

std::string_view to_string(MessageLevel level) noexcept {
  switch (level) {
    case MessageLevel::kInformation:
      return "information";
    case MessageLevel::kWarning:
      return "warning";
    case MessageLevel::kError:
      return "error";
  }
  return {};
}

double MessageBoard::stands_s(MessageLevel level) noexcept {
  switch (level) {
    case MessageLevel::kInformation:
      return 4.0;
    case MessageLevel::kWarning:
      return 8.0;
    case MessageLevel::kError:
      return 15.0;
  }
  return 0.0;
}

void MessageBoard::say(MessageLevel level, std::string text, double now_s) {
  message_ = Message{level, std::move(text)};
  until_s_ = now_s + stands_s(level);
}

const MessageBoard::Message* MessageBoard::shown(double now_s) const noexcept {
  return message_ && now_s < until_s_ ? &*message_ : nullptr;
}

}  // namespace striper::program
