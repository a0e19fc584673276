// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <striper/core/event_kinds.hpp>

namespace striper {

/// A row of `kEventKinds`, made from its word: EventCode("source_lost"). A word that is not in the
/// table does not compile.
class EventCode {
 public:
  // NOLINTNEXTLINE(google-explicit-constructor): a word stands for its code.
  consteval EventCode(const char* word) : row_(row_of(word)) {
    if (row_ == std::size(kEventKinds)) throw "no such event";  // NOLINT: at compile time.
  }

  /// The code of a word that was read; empty where there is none.
  static std::optional<EventCode> parse(std::string_view word) noexcept {
    const std::size_t row = row_of(word);
    if (row == std::size(kEventKinds)) return std::nullopt;
    return EventCode(row);
  }

  constexpr const EventKind& kind() const noexcept { return kEventKinds[row_]; }
  constexpr std::string_view word() const noexcept { return kind().word; }
  friend constexpr bool operator==(EventCode, EventCode) = default;

 private:
  explicit constexpr EventCode(std::size_t row) : row_(row) {}
  static constexpr std::size_t row_of(std::string_view word) noexcept {
    std::size_t row = 0;
    while (row < std::size(kEventKinds) && kEventKinds[row].word != word) ++row;
    return row;
  }

  std::size_t row_;
};

/// Something that happened, or was found, and that somebody should know.
struct Event {
  Severity severity = Severity::kInfo;
  EventCode code = "source_opened";
  std::string message;  ///< For people: what it is, with the figure and its bound.
  std::string advice;   ///< For people: what to do about it; may be empty.
  std::string head;     ///< Whose it is; empty where there are no heads.
  /// When, in seconds since 1970; NaN: now, filled in where it is sent.
  double time_s = std::numeric_limits<double>::quiet_NaN();

  Event() = default;
  /// As severe as its kind.
  Event(EventCode code_in, std::string message_in, std::string advice_in = {});
  Event(Severity severity_in, EventCode code_in, std::string message_in,
        std::string advice_in = {});
};

/// The worst severity among events; kInfo for none. @param events a range of Event.
template <typename Events>
Severity worst(const Events& events) {
  Severity worst = Severity::kInfo;
  for (const Event& event : events) worst = std::max(worst, event.severity);
  return worst;
}

using EventHandler = std::function<void(const Event&)>;

/// Where a part of the library sends its events: a handler of whoever made that part. Copies share
/// it. A default one is silent; the library never prints.
///
/// Thread-safe: a handler is called from whichever thread has something to say, one call at a time,
/// and must not call into what is sending.
class EventPort {
 public:
  EventPort() = default;
  explicit EventPort(EventHandler handler);

  /// Fills in the time where there is none. Never throws: what a handler throws is lost.
  void send(Event event) const noexcept;

  /// A port whose events are said to be of a head.
  EventPort of_head(std::string head) const;

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

}  // namespace striper
