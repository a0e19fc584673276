// SPDX-License-Identifier: Apache-2.0
#include "v4l2_vm/calls_between.hpp"

#include <algorithm>

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
  if (request == VIDIOC_REQBUFS) with_driver_ = 0;
  if (request == VIDIOC_STREAMON) taken_.clear();
  if (request == VIDIOC_DQBUF) {
    const auto& buffer = *static_cast<const v4l2_buffer*>(argument);
    taken_.push_back(
        {buffer.sequence, buffer.field, (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0, --with_driver_});
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
