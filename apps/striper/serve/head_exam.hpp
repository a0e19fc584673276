// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <mutex>
#include <optional>
#include <vector>

#include <striper/core/event.hpp>
#include <striper/core/frame_source.hpp>
#include <striper/stream/head.hpp>

#include "serve/scanner_settings.hpp"

namespace striper::program {

/// Looks at a head's frames and how they come, as `striper doctor` does: every three seconds
/// while somebody asks, never for longer. Thread-safe.
class HeadExam {
 public:
  /// @param settings how the head scans; outlive the exam.
  explicit HeadExam(const ScannerSettings& settings);

  /// On the head's thread: what it opened, and its frames, of which it keeps a few now and then.
  void note(const SourceInfo& source);
  void keep(const Frame& frame);
  void hear(const Event& event);

  /// To be called now and then by somebody who has time: looks at what was kept.
  void look(const HeadHealth& health);

  /// What is wrong with the head now, and what to do about it, what is worst first; does not wait:
  /// of the images it knows a few seconds after it was first asked.
  std::vector<Event> findings(const HeadHealth& health, const std::vector<SinkReport>& sinks);

 private:
  using Clock = std::chrono::steady_clock;
  struct Heard {
    Clock::time_point when;
    Event event;
  };

  bool is_due(Clock::time_point now) const;
  std::vector<Event> examine(const std::vector<Frame>& frames, const SourceInfo& source) const;
  void note_statistics(const SourceStatistics& now);
  void add_state(const HeadHealth& health, std::vector<Event>& found) const;
  void add_heard(std::vector<Event>& found) const;

  const ScannerSettings& settings_;
  mutable std::mutex mutex_;
  Clock::time_point asked_;
  Clock::time_point looked_;
  bool is_keeping_ = false;
  Clock::time_point keeping_since_;
  std::vector<Frame> kept_;
  std::size_t kept_bytes_ = 0;
  std::optional<SourceInfo> source_;
  std::vector<Event> of_images_;
  std::deque<Heard> heard_;
  SourceStatistics before_;  // Up to a minute ago: what was lost then is over.
  Clock::time_point before_when_;
};

}  // namespace striper::program
