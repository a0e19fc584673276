// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include <striper/stream/scan_bus.hpp>

#include "stream/sink_lane.hpp"

namespace striper {
namespace {

using Clock = std::chrono::steady_clock;
using detail::SinkLane;

// How often sinks are looked after, in shares of their patience: a stuck one is closed a tenth
// late.
constexpr int kLooksWhilePatient = 10;

// The same but for what counts up all the time.
bool says_the_same(const ScannerStatus& a, const ScannerStatus& b) {
  const AmbientStatus& x = a.ambient;
  const AmbientStatus& y = b.ambient;
  return a.source == b.source && a.axis == b.axis && a.is_stripe_seen == b.is_stripe_seen &&
         x.pattern == y.pattern && x.origin == y.origin && x.phase == y.phase &&
         x.channel == y.channel && x.method == y.method;
}

Frame with_own_pixels(const Frame& frame, std::string_view head) {
  Frame copy = frame;
  copy.head = head;
  copy.image = frame.image.clone();
  copy.lease.reset();
  return copy;
}

// What a bus remembers of a head.
struct KnownHead {
  std::string name;
  std::shared_ptr<const HeadInfo> info;  // Null before it is open.
  std::optional<ScannerStatus> status;
  Clock::time_point status_time;
};

}  // namespace

std::string_view to_string(SinkReport::State state) noexcept {
  switch (state) {
    case SinkReport::State::kFinished:
      return "finished";
    case SinkReport::State::kClosed:
      return "closed";
    case SinkReport::State::kOpen:
      break;
  }
  return "open";
}

HeadInfo head_info(std::string_view head, const SourceInfo& source,
                   const std::shared_ptr<const StriperModel>& model, StripeAxis axis) {
  HeadInfo info{std::string(head), source, model, axis, {}};
  const int lasers = model ? std::max(1, static_cast<int>(model->lasers.size())) : 1;
  for (int laser = 0; laser < lasers; ++laser) {
    info.frames.push_back(make_scan_frame(head, laser, model));
  }
  return info;
}

class ScanBus::Impl {
 public:
  Impl(EventPort events, const BusOptions& options)
      : events_(std::move(events)), options_(options) {}

  using Lanes = std::vector<std::shared_ptr<SinkLane>>;

  void add(std::string uri, std::unique_ptr<ScanSink> sink);
  std::vector<SinkReport> remove(std::string_view uri);
  void open(const HeadInfo& head);
  bool is_status_due(const ScannerStatus& status);
  bool can_wait(std::string_view head);
  void finish();

  /// Those that there are now.
  std::shared_ptr<const Lanes> lanes() const {
    const std::lock_guard lock(mutex_);
    return lanes_;
  }

 private:
  KnownHead& head_of(std::string_view name);
  void look_after_lanes();

  EventPort events_;
  BusOptions options_;

  std::mutex heads_mutex_;  // Locked before `mutex_`, where both are.
  std::vector<KnownHead> heads_;

  mutable std::mutex mutex_;  // Guards what follows.
  std::shared_ptr<const Lanes> lanes_ =
      std::make_shared<const Lanes>();  // Replaced, never changed.
  std::condition_variable ended_;
  bool is_ending_ = false;
  std::thread guard_;
};

void ScanBus::Impl::add(std::string uri, std::unique_ptr<ScanSink> sink) {
  sink->set_events(events_);
  const auto lane = std::make_shared<SinkLane>(std::move(uri), std::move(sink), options_, events_);
  lane->start();
  const std::lock_guard heads_lock(heads_mutex_);
  for (const KnownHead& head : heads_) {
    if (head.info) lane->take(head.info);
  }
  const std::lock_guard lock(mutex_);
  Lanes more = *lanes_;
  more.push_back(lane);
  lanes_ = std::make_shared<const Lanes>(std::move(more));
  if (!guard_.joinable()) guard_ = std::thread([this] { look_after_lanes(); });
}

std::vector<SinkReport> ScanBus::Impl::remove(std::string_view uri) {
  Lanes gone;
  {
    const std::lock_guard lock(mutex_);
    Lanes rest;
    for (const auto& lane : *lanes_) (lane->uri() == uri ? gone : rest).push_back(lane);
    lanes_ = std::make_shared<const Lanes>(std::move(rest));
  }
  std::vector<SinkReport> reports;
  for (const auto& lane : gone) {
    lane->ask_to_finish();
    lane->join();
    reports.push_back(lane->report());
  }
  return reports;
}

void ScanBus::Impl::look_after_lanes() {
  const auto interval = options_.stuck_after / kLooksWhilePatient;
  std::unique_lock lock(mutex_);
  while (!ended_.wait_for(lock, interval, [&] { return is_ending_; })) {
    const std::shared_ptr<const Lanes> now = lanes_;
    lock.unlock();  // What a lane says may come back as an event for all of them.
    for (const auto& lane : *now) lane->look_after(Clock::now());
    lock.lock();
  }
}

KnownHead& ScanBus::Impl::head_of(std::string_view name) {
  for (KnownHead& head : heads_) {
    if (head.name == name) return head;
  }
  heads_.push_back({std::string(name), nullptr, std::nullopt, {}});
  return heads_.back();
}

void ScanBus::Impl::open(const HeadInfo& head) {
  const auto shared = std::make_shared<const HeadInfo>(head);
  const std::lock_guard lock(heads_mutex_);  // A sink that is added meanwhile hears of it once.
  head_of(head.head).info = shared;
  for (const auto all = lanes(); const auto& lane : *all) lane->take(shared);
}

bool ScanBus::Impl::can_wait(std::string_view head) {
  const std::lock_guard lock(heads_mutex_);
  const KnownHead& known = head_of(head);
  return !known.info || known.info->can_wait();
}

bool ScanBus::Impl::is_status_due(const ScannerStatus& status) {
  const std::lock_guard lock(heads_mutex_);
  KnownHead& head = head_of(status.head);
  const Clock::time_point now = Clock::now();
  const bool is_old = !head.status || now - head.status_time >= options_.status_every;
  if (!is_old && says_the_same(*head.status, status)) return false;
  head.status = status;
  head.status_time = now;
  return true;
}

void ScanBus::Impl::finish() {
  const std::shared_ptr<const Lanes> all = lanes();
  for (const auto& lane : *all) lane->ask_to_finish();
  for (const auto& lane : *all) lane->join();
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  ended_.notify_all();
  if (guard_.joinable()) guard_.join();
}

ScanBus::ScanBus(EventPort events, const BusOptions& options)
    : impl_(std::make_unique<Impl>(std::move(events), options)) {}

ScanBus::~ScanBus() { impl_->finish(); }

void ScanBus::add(std::string uri, std::unique_ptr<ScanSink> sink) {
  impl_->add(std::move(uri), std::move(sink));
}

std::vector<SinkReport> ScanBus::remove(std::string_view uri) { return impl_->remove(uri); }

void ScanBus::open(const HeadInfo& head) { impl_->open(head); }

void ScanBus::write(const std::shared_ptr<const PolarScan>& scan) {
  const bool can_wait = impl_->can_wait(scan->head());
  for (const auto lanes = impl_->lanes(); const auto& lane : *lanes) {
    if (lane->needs().scans) lane->take(scan, can_wait);
  }
}

void ScanBus::write(ScanSpan scans) {
  for (std::size_t i = 0; i < scans.size(); ++i) write(scans.shared(i));
}

void ScanBus::write(const Frame& frame, std::string_view head) {
  std::shared_ptr<const Frame> copy;
  const Clock::time_point now = Clock::now();
  for (const auto lanes = impl_->lanes(); const auto& lane : *lanes) {
    if (!lane->is_frame_due(head, now)) continue;
    if (!copy) copy = std::make_shared<const Frame>(with_own_pixels(frame, head));
    lane->take(copy);
  }
}

void ScanBus::status(const ScannerStatus& status) {
  if (!impl_->is_status_due(status)) return;
  const auto shared = std::make_shared<const ScannerStatus>(status);
  for (const auto lanes = impl_->lanes(); const auto& lane : *lanes) {
    if (lane->needs().status) lane->take(shared);
  }
}

void ScanBus::event(const Event& event) {
  const auto shared = std::make_shared<const Event>(event);
  for (const auto lanes = impl_->lanes(); const auto& lane : *lanes) lane->take(shared);
}

void ScanBus::curbs(CurbsSeen seen) {
  const auto shared = std::make_shared<const CurbsSeen>(std::move(seen));
  for (const auto lanes = impl_->lanes(); const auto& lane : *lanes) lane->take(shared);
}

void ScanBus::objects(ObjectsSeen seen) {
  const auto shared = std::make_shared<const ObjectsSeen>(std::move(seen));
  for (const auto lanes = impl_->lanes(); const auto& lane : *lanes) lane->take(shared);
}

void ScanBus::finish() { impl_->finish(); }

std::vector<SinkReport> ScanBus::sinks() const {
  std::vector<SinkReport> reports;
  for (const auto lanes = impl_->lanes(); const auto& lane : *lanes)
    reports.push_back(lane->report());
  return reports;
}

bool ScanBus::is_any_open() const {
  const auto lanes = impl_->lanes();
  return std::any_of(lanes->begin(), lanes->end(), [](const auto& lane) {
    return lane->report().state == SinkReport::State::kOpen;
  });
}

std::exception_ptr ScanBus::failure() const {
  for (const auto lanes = impl_->lanes(); const auto& lane : *lanes) {
    if (std::exception_ptr failure = lane->failure()) return failure;
  }
  return nullptr;
}

}  // namespace striper
