// SPDX-License-Identifier: Apache-2.0
// Prints docs/events.md: every kind of event, as core/event_kinds.hpp has it.
#include <string>

#include <fmt/format.h>

#include <striper/core/event.hpp>

int main() {
  fmt::print(
      "# Events\n\n"
      "What striper has to say while it works is an event: a code, a severity, a message and what "
      "to do. Programs\nuse the code; messages are for people and may change. Made by "
      "`event_table > docs/events.md`.\n\n"
      "An event may be milder or worse than its kind: the severity here is the rule. `refusal` "
      "means that the result\nmust not be trusted.\n\n"
      "| code | severity | meaning |\n|---|---|---|\n");
  for (const striper::EventKind& kind : striper::kEventKinds) {
    fmt::print("| `{}` | {} | {} |\n", kind.word, to_string(kind.severity), kind.meaning);
  }
  return 0;
}
