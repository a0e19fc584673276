// SPDX-License-Identifier: Apache-2.0
#include "capture/frame_counts.hpp"

namespace striper::detail {

void FrameCounts::reset() {
  const std::lock_guard lock(mutex_);
  counts_ = {};
  last_sequence_.reset();
}

void FrameCounts::count(const Frame& frame) noexcept {
  ++counts_.delivered;
  if (frame.status == FrameStatus::kCorrupt) ++counts_.corrupt;
  if (frame.status == FrameStatus::kIncomplete) ++counts_.incomplete;
  if (frame.status == FrameStatus::kWrongSize) ++counts_.wrong_size;
}

void FrameCounts::deliver(const Frame& frame) {
  const std::lock_guard lock(mutex_);
  count(frame);
}

void FrameCounts::deliver_recorded(const Frame& frame) {
  const std::lock_guard lock(mutex_);
  count(frame);
  if (last_sequence_ && frame.sequence > *last_sequence_ + 1) {
    counts_.dropped += frame.sequence - *last_sequence_ - 1;
  }
  last_sequence_ = frame.sequence;
}

void FrameCounts::drop(std::uint64_t frames) {
  const std::lock_guard lock(mutex_);
  counts_.dropped += frames;
}

void FrameCounts::overrun(std::uint64_t frames) {
  const std::lock_guard lock(mutex_);
  counts_.overrun += frames;
}

void FrameCounts::reconnect() {
  const std::lock_guard lock(mutex_);
  ++counts_.reconnects;
}

SourceStatistics FrameCounts::now() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace striper::detail
