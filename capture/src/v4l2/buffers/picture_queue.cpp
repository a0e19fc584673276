// SPDX-License-Identifier: Apache-2.0
#include "v4l2/buffers/picture_queue.hpp"

#include <utility>

namespace striper::detail::v4l2 {

void PictureQueue::open() {
  const std::scoped_lock lock(mutex_);
  give_back_all();
  closed_ = NextStatus::kFrame;
}

bool PictureQueue::push(Picture&& picture) {
  Picture discarded;
  bool is_full = false;
  {
    const std::scoped_lock lock(mutex_);
    is_full = count_ == places_.size();
    if (is_full) {
      discarded = std::move(places_[first_]);
      first_ = (first_ + 1) % places_.size();
      --count_;
    }
    places_[(first_ + count_) % places_.size()] = std::move(picture);
    ++count_;
  }
  changed_.notify_one();
  if (discarded.ring) discarded.ring->give_back(discarded.buffer.index);
  return is_full;
}

NextStatus PictureQueue::pop(Picture& picture, std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  const bool is_ready =
      changed_.wait_for(lock, timeout, [&] { return count_ > 0 || closed_ != NextStatus::kFrame; });
  if (!is_ready) return NextStatus::kTimeout;
  if (count_ == 0 || closed_ == NextStatus::kStopped) return closed_;
  picture = std::move(places_[first_]);
  first_ = (first_ + 1) % places_.size();
  --count_;
  return NextStatus::kFrame;
}

bool PictureQueue::is_stopped() {
  const std::scoped_lock lock(mutex_);
  return closed_ == NextStatus::kStopped;
}

void PictureQueue::close(NextStatus reason) {
  {
    const std::scoped_lock lock(mutex_);
    closed_ = reason;
    if (reason == NextStatus::kStopped) give_back_all();
  }
  changed_.notify_all();
}

void PictureQueue::give_back_all() {
  for (; count_ > 0; --count_) {
    Picture picture = std::move(places_[first_]);
    first_ = (first_ + 1) % places_.size();
    if (picture.ring) picture.ring->give_back(picture.buffer.index);
  }
}

}  // namespace striper::detail::v4l2
