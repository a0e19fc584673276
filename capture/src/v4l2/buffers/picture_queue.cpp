// SPDX-License-Identifier: Apache-2.0
#include "v4l2/buffers/picture_queue.hpp"

#include <utility>

namespace striper::detail::v4l2 {

void FrameQueue::open() {
  const std::scoped_lock lock(mutex_);
  give_back_all();
  closed_ = NextStatus::kFrame;
}

bool FrameQueue::push(QueuedFrame&& frame) {
  QueuedFrame discarded;
  bool is_full = false;
  {
    const std::scoped_lock lock(mutex_);
    is_full = count_ == places_.size();
    if (is_full) {
      discarded = std::move(places_[first_]);
      first_ = (first_ + 1) % places_.size();
      --count_;
    }
    places_[(first_ + count_) % places_.size()] = std::move(frame);
    ++count_;
  }
  changed_.notify_one();
  if (discarded.ring) discarded.ring->give_back(discarded.buffer.index);
  return is_full;
}

NextStatus FrameQueue::pop(QueuedFrame& frame, std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  const bool is_ready =
      changed_.wait_for(lock, timeout, [&] { return count_ > 0 || closed_ != NextStatus::kFrame; });
  if (!is_ready) return NextStatus::kTimeout;
  if (count_ == 0 || closed_ == NextStatus::kStopped) return closed_;
  frame = std::move(places_[first_]);
  first_ = (first_ + 1) % places_.size();
  --count_;
  return NextStatus::kFrame;
}

bool FrameQueue::is_stopped() {
  const std::scoped_lock lock(mutex_);
  return closed_ == NextStatus::kStopped;
}

void FrameQueue::close(NextStatus reason) {
  {
    const std::scoped_lock lock(mutex_);
    closed_ = reason;
    if (reason == NextStatus::kStopped) give_back_all();
  }
  changed_.notify_all();
}

void FrameQueue::give_back_all() {
  for (; count_ > 0; --count_) {
    QueuedFrame frame = std::move(places_[first_]);
    first_ = (first_ + 1) % places_.size();
    if (frame.ring) frame.ring->give_back(frame.buffer.index);
  }
}

}  // namespace striper::detail::v4l2
