// SPDX-License-Identifier: Apache-2.0
#include "stream/sink_lane.hpp"

#include <cerrno>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::detail {
namespace {

constexpr std::size_t kNewestKept = 2;
// Nothing sends so many events for good; what does must not fill the memory.
constexpr std::size_t kMostControls = 1000;
// Beside the scans that wait, before the queue has to grow: a frame, a status and a few events.
constexpr std::size_t kOthersWaiting = 8;

bool is_disk_full(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const Error& error) {
    return error.system_error() == ENOSPC || error.system_error() == EDQUOT;
  } catch (...) {
    return false;
  }
}

std::string what_of(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "it threw something that is no exception";
  }
}

}  // namespace

SinkLane::SinkLane(std::string uri, std::unique_ptr<ScanSink> sink, const BusOptions& options,
                   EventPort events)
    : uri_(std::move(uri)),
      options_(options),
      events_(std::move(events)),
      needs_(sink->needs()),
      sink_(std::move(sink)),
      queue_(options.scans_waiting + kOthersWaiting) {}

void SinkLane::start() {
  thread_ = std::thread([self = shared_from_this()] { self->run(); });
}

// --- What is given to it, on anybody's thread.

void SinkLane::push(Job job) {
  queue_.push({std::move(job), Clock::now()});
  work_.notify_one();
}

void SinkLane::push_control(Job job) {
  const std::lock_guard lock(mutex_);
  if (!is_open() || controls_queued_ >= kMostControls) return;
  ++controls_queued_;
  push(std::move(job));
}

void SinkLane::take(std::shared_ptr<const HeadInfo> head) { push_control(std::move(head)); }

void SinkLane::take(std::shared_ptr<const Event> event) { push_control(std::move(event)); }

void SinkLane::take(std::shared_ptr<const CurbsSeen> seen) { push_control(std::move(seen)); }

void SinkLane::take(std::shared_ptr<const ObjectsSeen> seen) { push_control(std::move(seen)); }

void SinkLane::take(const std::shared_ptr<const PolarScan>& scan, bool can_wait) {
  std::unique_lock lock(mutex_);
  const bool is_lossless = needs_.delivery == Delivery::kLossless;
  if (is_lossless && can_wait) {
    room_.wait(lock, [&] { return !is_open() || scans_queued_ < options_.scans_waiting; });
  }
  const bool is_lost = !is_open() || (is_lossless && !can_wait && has_waited_too_long());
  if (is_lost) {
    ++lost_;
    const bool is_news = is_open() && !std::exchange(is_slow_said_, true);
    lock.unlock();
    if (is_news) {
      events_.send({"sink_slow", fmt::format("sink {} does not keep up: scans are dropped", uri_),
                    "a faster disk or network, or fewer scans a second"});
    }
    return;
  }
  if (!is_lossless && scans_queued_ == kNewestKept) {
    withdraw_oldest_scan();
    --scans_queued_;
    ++lost_;
  }
  ++scans_queued_;
  push(scan);
}

void SinkLane::take(std::shared_ptr<const Frame> frame) {
  const std::lock_guard lock(mutex_);
  if (!is_open()) return;
  withdraw_of_head<Frame>(frame->head);
  push(std::move(frame));
}

void SinkLane::take(std::shared_ptr<const ScannerStatus> status) {
  const std::lock_guard lock(mutex_);
  if (!is_open()) return;
  withdraw_of_head<ScannerStatus>(status->head);
  push(std::move(status));
}

bool SinkLane::is_frame_due(std::string_view head, Clock::time_point now) {
  if (!(needs_.frames_hz > 0.0)) return false;
  const std::lock_guard lock(mutex_);
  const auto period = std::chrono::duration<double>(1.0 / needs_.frames_hz);
  if (!is_open()) return false;
  const auto last = last_frames_.find(head);
  if (last == last_frames_.end()) return last_frames_.emplace(head, now).second;
  if (now - last->second < period) return false;
  last->second = now;
  return true;
}

bool SinkLane::has_waited_too_long() noexcept {
  for (std::size_t i = 0; i < queue_.size(); ++i) {
    if (!std::holds_alternative<std::shared_ptr<const PolarScan>>(queue_[i].job)) continue;
    return Clock::now() - queue_[i].since >= options_.live_hold;
  }
  return false;
}

// What is withdrawn leaves an empty place, so that the order of the rest stays.
void SinkLane::withdraw_oldest_scan() {
  for (std::size_t i = 0; i < queue_.size(); ++i) {
    if (!std::holds_alternative<std::shared_ptr<const PolarScan>>(queue_[i].job)) continue;
    queue_[i].job = std::monostate{};
    break;
  }
  while (!queue_.empty() && std::holds_alternative<std::monostate>(queue_.front().job)) {
    queue_.pop();
  }
}

template <typename Kind>
void SinkLane::withdraw_of_head(const std::string& head) {
  for (std::size_t i = 0; i < queue_.size(); ++i) {
    const auto* const queued = std::get_if<std::shared_ptr<const Kind>>(&queue_[i].job);
    if (queued != nullptr && (*queued)->head == head) queue_[i].job = std::monostate{};
  }
}

// --- The sink's own thread.

void SinkLane::run() {
  std::unique_lock lock(mutex_);
  Job job;
  while (wait_for_job(lock, job)) {
    is_writing_scan_ = std::holds_alternative<std::shared_ptr<const PolarScan>>(job);
    busy_since_ = Clock::now();
    lock.unlock();
    std::exception_ptr failure;
    try {
      execute(job);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    busy_since_.reset();
    if (!is_open()) break;  // Given up meanwhile.
    if (failure) {
      close(failure);
      lock.unlock();
      say_failure(failure);
      lock.lock();
      break;
    }
    conclude(job);
    job = std::monostate{};
    if (!is_open()) break;
  }
  end_sink(lock);
}

bool SinkLane::wait_for_job(std::unique_lock<std::mutex>& lock, Job& job) {
  work_.wait(lock, [&] { return !is_open() || !queue_.empty(); });
  if (!is_open()) return false;
  job = std::move(queue_.pop().job);
  if (std::holds_alternative<std::shared_ptr<const PolarScan>>(job)) {
    --scans_queued_;
    room_.notify_all();
  }
  if (is_control(job)) --controls_queued_;
  return true;
}

bool SinkLane::is_control(const Job& job) noexcept {
  return std::holds_alternative<std::shared_ptr<const HeadInfo>>(job) ||
         std::holds_alternative<std::shared_ptr<const Event>>(job) ||
         std::holds_alternative<std::shared_ptr<const CurbsSeen>>(job) ||
         std::holds_alternative<std::shared_ptr<const ObjectsSeen>>(job);
}

void SinkLane::execute(const Job& job) {
  struct Visitor {
    ScanSink& sink;
    void operator()(std::monostate) const {}
    void operator()(const std::shared_ptr<const PolarScan>& scan) const { sink.write(*scan); }
    void operator()(const std::shared_ptr<const Frame>& frame) const { sink.write(*frame); }
    void operator()(const std::shared_ptr<const HeadInfo>& head) const { sink.open(*head); }
    void operator()(const std::shared_ptr<const ScannerStatus>& s) const { sink.status(*s); }
    void operator()(const std::shared_ptr<const Event>& event) const { sink.event(*event); }
    void operator()(const std::shared_ptr<const CurbsSeen>& seen) const { sink.curbs(*seen); }
    void operator()(const std::shared_ptr<const ObjectsSeen>& seen) const { sink.objects(*seen); }
    void operator()(Finish) const { sink.finish(); }
  };
  std::visit(Visitor{*sink_}, job);
}

void SinkLane::conclude(const Job& job) {
  if (is_writing_scan_) ++written_;
  is_writing_scan_ = false;
  if (std::holds_alternative<Finish>(job)) state_ = SinkReport::State::kFinished;
}

// Closing a file may hang as well as writing to it: it is looked after to its end.
void SinkLane::end_sink(std::unique_lock<std::mutex>& lock) {
  busy_since_ = Clock::now();
  lock.unlock();
  sink_.reset();
  lock.lock();
  busy_since_.reset();
  is_over_ = true;
  room_.notify_all();
}

// --- Its end.

void SinkLane::look_after(Clock::time_point now) {
  std::unique_lock lock(mutex_);
  const bool is_stuck =
      busy_since_ && !is_left_behind_ && now - *busy_since_ >= options_.stuck_after;
  if (!is_stuck) return;
  is_left_behind_ = true;
  const bool is_news = is_open();
  const auto why = std::make_exception_ptr(Error(
      ErrorKind::kIo, fmt::format("it did not return for {:g} s",
                                  std::chrono::duration<double>(options_.stuck_after).count())));
  if (is_news) close(why);
  room_.notify_all();
  lock.unlock();
  if (is_news) say_failure(why);
}

// What is queued, or half written, is lost; what comes later will be.
void SinkLane::close(std::exception_ptr why) {
  state_ = SinkReport::State::kClosed;
  failure_ = std::move(why);
  lost_ += scans_queued_ + (is_writing_scan_ ? 1 : 0);
  scans_queued_ = controls_queued_ = 0;
  is_writing_scan_ = false;
  while (!queue_.empty()) queue_.pop();
  work_.notify_all();
  room_.notify_all();
}

void SinkLane::say_failure(const std::exception_ptr& why) const {
  const bool is_full = is_disk_full(why);
  events_.send(
      {is_full ? EventCode("disk_full") : EventCode("sink_failed"),
       fmt::format("sink {} is closed after {} scans: {}", uri_, report().written, what_of(why)),
       is_full ? "make room, and start again" : ""});
}

void SinkLane::say_losses() const {
  const SinkReport now = report();
  if (now.lost == 0) return;
  const bool is_meant =
      now.delivery == Delivery::kNewest && now.state == SinkReport::State::kFinished;
  events_.send({is_meant ? Severity::kInfo : Severity::kWarning, "sink_slow",
                fmt::format("sink {} got {} of {} scans, and lost {}", uri_, now.written,
                            now.written + now.lost, now.lost)});
}

void SinkLane::ask_to_finish() {
  const std::lock_guard lock(mutex_);
  if (is_open()) push(Finish{});
}

void SinkLane::join() {
  if (!thread_.joinable()) return;
  {
    std::unique_lock lock(mutex_);
    room_.wait(lock, [&] { return is_over_ || is_left_behind_; });
    if (!is_over_) thread_.detach();
  }
  if (thread_.joinable()) thread_.join();
  say_losses();
}

SinkReport SinkLane::report() const {
  const std::lock_guard lock(mutex_);
  return {uri_, state_, needs_.delivery, written_, lost_};
}

std::exception_ptr SinkLane::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

}  // namespace striper::detail
