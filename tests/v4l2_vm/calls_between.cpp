// SPDX-License-Identifier: Apache-2.0
#include "v4l2_vm/calls_between.hpp"

#include <algorithm>
#include <chrono>

#include <linux/videodev2.h>

namespace striper::testing {

int WatchedCalls::control(int fd, unsigned long request, void* argument) noexcept {
  const std::scoped_lock lock(mutex_);  // One order of events for both threads.
  const int error = PassedCalls::control(fd, request, argument);
  note(request, argument, error);
  return error;
}

void WatchedCalls::note(unsigned long request, const void* argument, int error) {
  if (request == VIDIOC_QBUF) ++(error == 0 ? with_driver_ : refused_buffers_);
  if (error != 0) return;
  if (request == VIDIOC_QBUF) {
    queued_ns_.push_back(std::chrono::steady_clock::now().time_since_epoch().count());
  }
  if (request == VIDIOC_REQBUFS) {
    with_driver_ = 0;
    const bool are_new = static_cast<const v4l2_requestbuffers*>(argument)->count > 0;
    if (are_new) queued_ns_.clear();
  }
  if (request == VIDIOC_STREAMON) taken_.clear();
  if (request == VIDIOC_DQBUF) {
    const auto& buffer = *static_cast<const v4l2_buffer*>(argument);
    const std::int64_t time_ns =
        buffer.timestamp.tv_sec * 1'000'000'000LL + buffer.timestamp.tv_usec * 1'000LL;
    taken_.push_back({buffer.sequence, buffer.field, (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0,
                      --with_driver_, time_ns});
  }
}

std::vector<WatchedCalls::Taken> WatchedCalls::taken() const {
  const std::scoped_lock lock(mutex_);
  return taken_;
}

std::uint64_t WatchedCalls::lost() const {
  const std::scoped_lock lock(mutex_);
  std::uint64_t lost = 0;
  for (std::size_t at = 1; at < taken_.size(); ++at)
    lost += lost_between(taken_[at - 1], taken_[at]);
  return lost;
}

std::uint64_t WatchedCalls::flagged() const {
  const std::scoped_lock lock(mutex_);
  return static_cast<std::uint64_t>(
      std::count_if(taken_.begin(), taken_.end(), [](const Taken& one) { return one.is_flagged; }));
}

std::uint64_t WatchedCalls::lost_for_want_of_a_buffer(std::int64_t frame_period_ns) const {
  const std::scoped_lock lock(mutex_);
  std::uint64_t lost = 0;
  for (std::size_t at = 1; at < taken_.size(); ++at) {
    const std::uint64_t frames = lost_between(taken_[at - 1], taken_[at]);
    for (std::uint64_t frame = 0; frame < frames; ++frame) {
      // A frame begins where the one before it ended.
      const std::int64_t began_ns =
          taken_[at - 1].time_ns + static_cast<std::int64_t>(frame) * frame_period_ns;
      const auto queued = std::upper_bound(queued_ns_.begin(), queued_ns_.end(), began_ns);
      if (static_cast<std::size_t>(queued - queued_ns_.begin()) <= at) ++lost;
    }
  }
  return lost;
}

int WatchedCalls::refused_buffers() const {
  const std::scoped_lock lock(mutex_);
  return refused_buffers_;
}

int RelabelledFields::control(int fd, unsigned long request, void* argument) noexcept {
  const auto label = [&](std::uint32_t from, std::uint32_t to) {
    if (request == VIDIOC_S_FMT || request == VIDIOC_G_FMT) {
      std::uint32_t& field = static_cast<v4l2_format*>(argument)->fmt.pix.field;
      if (field == from) field = to;
    } else if (request == VIDIOC_DQBUF) {
      std::uint32_t& field = static_cast<v4l2_buffer*>(argument)->field;
      if (field == from) field = to;
    }
  };
  label(wanted_, real_);
  const int error = PassedCalls::control(fd, request, argument);
  label(real_, wanted_);
  return error;
}

}  // namespace striper::testing
