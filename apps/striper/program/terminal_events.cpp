// SPDX-License-Identifier: Apache-2.0
#include "program/terminal_events.hpp"

#include <algorithm>
#include <mutex>
#include <string_view>

#include <fmt/format.h>

#include "program/terminal.hpp"

namespace striper::program {
namespace {

constexpr std::ptrdiff_t kSaidOfAKind = 10;
constexpr std::size_t kMostKept = 1000;

const char* words_for(PatternOrigin origin) {
  switch (origin) {
    case PatternOrigin::kGiven:
      return "given";
    case PatternOrigin::kFrames:
      return "from the frames";
    case PatternOrigin::kFound:
      return "found";
    case PatternOrigin::kPhase:
      return "its phase found in the frames";
    case PatternOrigin::kAssumed:
      return "no dark exposure seen";
    case PatternOrigin::kNone:
      break;
  }
  return "unknown";
}

std::string words_for(AmbientMethod method) {
  if (method != AmbientMethod::kTemporal) return std::string(to_string(method));
  return "temporal (for a sensor that stands still: what does so too, a stripe included, is taken "
         "off)";
}

}  // namespace

std::string sentence(const Event& event) {
  std::string text = event.severity == Severity::kInfo
                         ? event.message
                         : fmt::format("{}: {}", to_string(event.severity), event.message);
  if (!event.advice.empty()) text += "\n    " + event.advice;
  return text;
}

std::vector<std::string> decisions(const AmbientStatus& status) {
  std::vector<std::string> lines;
  if (status.is_decided()) {
    lines.push_back(fmt::format("channel {}", to_string(*status.channel)));
    lines.push_back(
        fmt::format("pattern {} ({})", status.pattern.to_string(), words_for(status.origin)));
    lines.push_back("ambient " + words_for(status.method));
  }
  if (status.unpaired > 0) {
    lines.push_back(fmt::format(
        "{} lit exposures gave no scan: no dark neighbour was left that fits", status.unpaired));
  }
  return lines;
}

struct TerminalEvents::State {
  void hear(const Event& event) {
    const std::lock_guard lock(mutex);
    const auto is_same = [&](const Event& other) { return other.code == event.code; };
    const auto before = std::count_if(heard.begin(), heard.end(), is_same);
    if (heard.size() < kMostKept) heard.push_back(event);
    const bool is_said = std::find(unsaid.begin(), unsaid.end(), event.code) == unsaid.end();
    if (is_silent || !is_said || event.severity < Severity::kWarning) return;
    if (before < kSaidOfAKind) say(sentence(event));
    if (before == kSaidOfAKind) say(fmt::format("further {} are only counted", event.code.word()));
  }

  std::mutex mutex;
  bool is_silent = false;
  std::vector<EventCode> unsaid;
  std::vector<Event> heard;
};

TerminalEvents::TerminalEvents(std::initializer_list<EventCode> unsaid)
    : state_(std::make_shared<State>()),
      port_([state = state_](const Event& event) { state->hear(event); }) {
  state_->unsaid = unsaid;
}

TerminalEvents TerminalEvents::silent() {
  TerminalEvents events;
  events.state_->is_silent = true;
  return events;
}

std::vector<Event> TerminalEvents::heard() const {
  const std::lock_guard lock(state_->mutex);
  return state_->heard;
}

}  // namespace striper::program
