// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <variant>

#include <striper/stream/scan_bus.hpp>

#include "stream/ring.hpp"

namespace striper::detail {

/// A sink with its queue and its thread. The thread holds the lane, so that one that never returns
/// can be left behind: it then touches nothing but its lane, and destroys the sink when it does
/// return. Thread-safe.
class SinkLane : public std::enable_shared_from_this<SinkLane> {
 public:
  using Clock = std::chrono::steady_clock;

  SinkLane(std::string uri, std::unique_ptr<ScanSink> sink, const BusOptions& options,
           EventPort events);

  void start();

  void take(std::shared_ptr<const HeadInfo> head);
  void take(const std::shared_ptr<const PolarScan>& scan, bool can_wait);
  void take(std::shared_ptr<const Frame> frame);
  void take(std::shared_ptr<const ScannerStatus> status);
  void take(std::shared_ptr<const Event> event);
  void take(std::shared_ptr<const CurbsSeen> seen);
  void take(std::shared_ptr<const ObjectsSeen> seen);

  const std::string& uri() const noexcept { return uri_; }
  const SinkNeeds& needs() const noexcept { return needs_; }
  /// Whether the rate at which the sink wants frames of a head allows one now; it is then taken to
  /// get it.
  bool is_frame_due(std::string_view head, Clock::time_point now);

  /// Closes the sink where it has not returned for too long.
  void look_after(Clock::time_point now);

  /// After what is queued, finish; `join` waits for that, or until the sink is left behind.
  void ask_to_finish();
  void join();

  SinkReport report() const;
  std::exception_ptr failure() const;

 private:
  struct Finish {};
  using Job =
      std::variant<std::monostate, std::shared_ptr<const PolarScan>, std::shared_ptr<const Frame>,
                   std::shared_ptr<const HeadInfo>, std::shared_ptr<const ScannerStatus>,
                   std::shared_ptr<const Event>, std::shared_ptr<const CurbsSeen>,
                   std::shared_ptr<const ObjectsSeen>, Finish>;
  struct Entry {
    Job job;
    Clock::time_point since;
  };

  void run();
  bool wait_for_job(std::unique_lock<std::mutex>& lock, Job& job);
  void execute(const Job& job);
  void conclude(const Job& job);
  void end_sink(std::unique_lock<std::mutex>& lock);

  bool is_open() const noexcept { return state_ == SinkReport::State::kOpen; }
  void push(Job job);
  void push_control(Job job);
  static bool is_control(const Job& job) noexcept;
  bool has_waited_too_long() noexcept;
  void withdraw_oldest_scan();
  template <typename Kind>
  void withdraw_of_head(const std::string& head);
  void close(std::exception_ptr why);
  void say_failure(const std::exception_ptr& why) const;
  void say_losses() const;

  const std::string uri_;
  const BusOptions options_;
  const EventPort events_;
  const SinkNeeds needs_;
  std::unique_ptr<ScanSink> sink_;  // The thread's alone, once that runs.
  std::thread thread_;

  mutable std::mutex mutex_;  // Guards what follows.
  std::condition_variable work_;
  std::condition_variable room_;
  Ring<Entry> queue_;
  std::size_t scans_queued_ = 0;
  std::size_t controls_queued_ = 0;  // All that is neither scan, frame nor status.
  SinkReport::State state_ = SinkReport::State::kOpen;
  std::uint64_t written_ = 0;
  std::uint64_t lost_ = 0;
  bool is_writing_scan_ = false;
  bool is_slow_said_ = false;
  bool is_over_ = false;         // The thread is about to end.
  bool is_left_behind_ = false;  // It may never.
  std::optional<Clock::time_point> busy_since_;
  std::map<std::string, Clock::time_point, std::less<>> last_frames_;  // Of each head.
  std::exception_ptr failure_;
};

}  // namespace striper::detail
