// SPDX-License-Identifier: Apache-2.0
#include "guide/queued_output.hpp"

#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <type_traits>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include <striper/core/error.hpp>

#include "program/program.hpp"
#include "program/terminal.hpp"

namespace striper::program {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostQueued = 4096;  // Some seconds of a run of three beams at 176 scans/s.
constexpr auto kLook = 10ms;               // How often a wait looks whether it is to end.
constexpr auto kEndsWithin = 200ms;
constexpr auto kOpensWithin = 300ms;  // A file does.

// What a reader that comes back must know has room where the rest has none: switches are few.
constexpr std::size_t kMostOfAll = 2 * kMostQueued;

struct GunSwitch {
  std::size_t gun;
  bool is_on;
  double time_s;
};
struct LaserOff {
  double time_s;
};
using Message = std::variant<LateralLine, GunSwitch, GunLine, SeenLine, FaultLine, LaserOff>;

template <typename Told>
constexpr bool kIsVital = std::is_same_v<Told, GunSwitch> || std::is_same_v<Told, LaserOff> ||
                          std::is_same_v<Told, FaultLine>;

struct Teller {
  GuidanceOutput& to;
  void operator()(const LateralLine& line) const { to.lateral(line); }
  void operator()(const GunSwitch& one) const { to.switch_gun(one.gun, one.is_on, one.time_s); }
  void operator()(const GunLine& line) const { to.gun(line); }
  void operator()(const SeenLine& line) const { to.seen(line); }
  void operator()(const FaultLine& line) const { to.fault(line); }
  void operator()(const LaserOff& off) const { to.switch_laser_off(off.time_s); }
};

}  // namespace

// What both threads know.
struct QueuedOutput::Desk {
  mutable std::mutex mutex;
  std::condition_variable came;
  std::condition_variable went;
  std::deque<Message> queue;
  bool is_open = false;
  bool is_closing = false;
  bool is_done = false;
  std::exception_ptr failure;
  Account account;

  void work(const Open& open) {
    try {
      const std::unique_ptr<GuidanceOutput> output = open();
      {
        const std::lock_guard lock(mutex);
        is_open = true;
        went.notify_all();
      }
      while (const auto message = next()) std::visit(Teller{*output}, *message);
      output->finish();
      const std::lock_guard lock(mutex);
      const std::uint64_t dropped = account.lost;
      account = output->account();
      account.lost += dropped;
    } catch (...) {
      const std::lock_guard lock(mutex);
      failure = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    is_done = true;
    went.notify_all();
  }

  // Nothing at the end.
  std::optional<Message> next() {
    std::unique_lock lock(mutex);
    came.wait(lock, [this] { return !queue.empty() || is_closing; });
    if (queue.empty()) return {};
    Message message = std::move(queue.front());
    queue.pop_front();
    went.notify_all();
    return message;
  }

  void rethrow() {
    if (failure) std::rethrow_exception(std::exchange(failure, nullptr));
  }
};

QueuedOutput::QueuedOutput(const std::string& address, Open open, WhenFull when_full)
    : desk_(std::make_shared<Desk>()),
      when_full_(when_full),
      thread_([desk = desk_, open = std::move(open)] { desk->work(open); }) {
  try {
    wait_until_open(address);
  } catch (...) {
    if (thread_.joinable()) thread_.join();
    throw;
  }
}

QueuedOutput::~QueuedOutput() {
  try {
    QueuedOutput::finish();
  } catch (const std::exception&) {
    // What broke the run off is told; this would hide it.
  }
}

// A named pipe opens when somebody reads it.
void QueuedOutput::wait_until_open(const std::string& address) {
  const Clock::time_point begin = Clock::now();
  bool is_told = false;
  std::unique_lock lock(desk_->mutex);
  while (!desk_->is_open && !desk_->is_done) {
    if (stop_requested()) {
      leave_behind();
      throw Error(ErrorKind::kIo,
                  fmt::format("--to {}: interrupted before anybody read it", address));
    }
    if (!is_told && Clock::now() - begin > kOpensWithin) {
      is_told = true;
      say(fmt::format("--to {}: waits until somebody reads it; Ctrl-C ends", address));
    }
    desk_->went.wait_for(lock, kLook);
  }
  desk_->rethrow();
}

void QueuedOutput::leave_behind() {
  is_finished_ = true;
  thread_.detach();
  leave_threads_behind();
}

template <typename Told>
void QueuedOutput::tell(const Told& told) {
  std::unique_lock lock(desk_->mutex);
  while (when_full_ == WhenFull::kWait && desk_->queue.size() >= kMostQueued && !desk_->is_done &&
         !stop_requested()) {
    desk_->went.wait_for(lock, kLook);
  }
  if (when_full_ == WhenFull::kWait) desk_->rethrow();
  if (desk_->is_done || desk_->queue.size() >= (kIsVital<Told> ? kMostOfAll : kMostQueued)) {
    ++desk_->account.lost;
    return;
  }
  desk_->queue.emplace_back(told);
  desk_->came.notify_one();
}

void QueuedOutput::lateral(const LateralLine& line) { tell(line); }
void QueuedOutput::switch_gun(std::size_t gun, bool is_on, double time_s) {
  tell(GunSwitch{gun, is_on, time_s});
}
void QueuedOutput::gun(const GunLine& line) { tell(line); }
void QueuedOutput::seen(const SeenLine& line) { tell(line); }
void QueuedOutput::fault(const FaultLine& line) { tell(line); }
void QueuedOutput::switch_laser_off(double time_s) { tell(LaserOff{time_s}); }

void QueuedOutput::finish() {
  if (std::exchange(is_finished_, true)) return;
  std::unique_lock lock(desk_->mutex);
  desk_->is_closing = true;
  desk_->came.notify_one();
  Clock::time_point hurries = Clock::now();
  while (!desk_->is_done && Clock::now() - hurries < kEndsWithin) {
    if (when_full_ == WhenFull::kWait && !stop_requested()) hurries = Clock::now();
    desk_->went.wait_for(lock, kLook);
  }
  if (desk_->is_done) {
    lock.unlock();
    thread_.join();
    return desk_->rethrow();
  }
  // And the one that says that all is safe.
  desk_->account.lost += desk_->queue.size() + 1;
  desk_->account.why = "nobody reads them";
  leave_behind();
}

QueuedOutput::Account QueuedOutput::account() const {
  const std::lock_guard lock(desk_->mutex);
  return desk_->account;
}

}  // namespace striper::program
