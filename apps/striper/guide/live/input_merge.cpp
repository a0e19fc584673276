// SPDX-License-Identifier: Apache-2.0
#include "guide/live/input_merge.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace striper::program {
namespace {

// A stream whose own time goes back by more has had its clock set.
constexpr double kSetBack_s = 1.0;

bool is_before(const LiveInput& a, const LiveInput& b) {
  const double a_s = time_of(a);
  const double b_s = time_of(b);
  return a_s != b_s ? a_s < b_s : a.index() < b.index();
}

}  // namespace

double time_of(const LiveInput& input) {
  return std::visit([](const auto& one) { return one.time_s; }, input);
}

InputMerge::InputMerge(std::size_t streams, std::chrono::milliseconds patience)
    : streams_(streams), patience_(patience), given_s_(-std::numeric_limits<double>::infinity()) {}

void InputMerge::insert(LiveInput input) {
  // Mostly the newest: from the back.
  auto at = waiting_.end();
  while (at != waiting_.begin() && is_before(input, *(at - 1))) --at;
  waiting_.insert(at, std::move(input));
}

void InputMerge::give(std::size_t stream, LiveInput input) {
  const std::lock_guard lock(mutex_);
  Stream& of = streams_[stream];
  if (time_of(input) < of.last_s - kSetBack_s) begin_anew();
  of.last_s = time_of(input);
  of.heard = Clock::now();
  of.is_waited_for = true;
  if (time_of(input) < given_s_) {
    ++late_;
    return;
  }
  heard_ = of.heard;
  if (std::holds_alternative<OdometerReading>(input)) heard_odometer_ = of.heard;
  insert(std::move(input));
  came_.notify_one();
}

// What waits is of the clock as it was.
void InputMerge::begin_anew() {
  late_ += waiting_.size();
  waiting_.clear();
  given_s_ = -std::numeric_limits<double>::infinity();
}

void InputMerge::leave(std::size_t stream) {
  const std::lock_guard lock(mutex_);
  streams_[stream].is_waited_for = false;
  came_.notify_one();
}

void InputMerge::close() {
  const std::lock_guard lock(mutex_);
  is_closed_ = true;
  came_.notify_one();
}

bool InputMerge::is_due(const LiveInput& input, Clock::time_point now) const {
  if (is_closed_) return true;
  return std::all_of(streams_.begin(), streams_.end(), [&](const Stream& stream) {
    return !stream.is_waited_for || stream.last_s >= time_of(input) ||
           now - stream.heard > patience_;
  });
}

std::optional<LiveInput> InputMerge::next(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  const Clock::time_point until = Clock::now() + timeout;
  while (waiting_.empty() || !is_due(waiting_.front(), Clock::now())) {
    if (is_closed_ || Clock::now() >= until) return {};
    came_.wait_until(lock, std::min(until, Clock::now() + std::chrono::milliseconds(5)));
  }
  LiveInput input = std::move(waiting_.front());
  waiting_.pop_front();
  given_s_ = time_of(input);
  return input;
}

bool InputMerge::is_over() const {
  const std::lock_guard lock(mutex_);
  return is_closed_ && waiting_.empty();
}

std::optional<InputMerge::Clock::time_point> InputMerge::heard() const {
  const std::lock_guard lock(mutex_);
  return heard_;
}

std::optional<InputMerge::Clock::time_point> InputMerge::heard_odometer() const {
  const std::lock_guard lock(mutex_);
  return heard_odometer_;
}

std::uint64_t InputMerge::late() const {
  const std::lock_guard lock(mutex_);
  return late_;
}

}  // namespace striper::program
