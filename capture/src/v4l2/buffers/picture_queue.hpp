// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <striper/core/frame_source.hpp>

#include "v4l2/buffers/buffer_ring.hpp"
#include "v4l2/buffers/exposure_clock.hpp"

namespace striper::detail::v4l2 {

/// A frame on its way from the capture thread to the reader.
struct QueuedFrame {
  std::shared_ptr<BufferRing> ring;  ///< Empty where the frame is not to be used.
  FilledBuffer buffer;
  ExposurePlace place;
  Field field = Field::kProgressive;  ///< kTop or kBottom where the buffer is one field.
  FrameStatus status = FrameStatus::kOk;
  const char* detail = "";
};

/// A short queue between the capture thread and the reader. When it is full the oldest frame goes
/// back to the driver: a late reader gets fresh frames. Allocates nothing after construction.
class FrameQueue {
 public:
  explicit FrameQueue(int capacity) : places_(static_cast<std::size_t>(capacity)) {}

  /// Empties the queue and lets frames through.
  void open();

  /// Adds a frame. @return whether the oldest one was discarded for it.
  bool push(QueuedFrame&& frame);

  /// Takes the oldest frame, waiting at most `timeout`. Once closed: what it was closed with; a
  /// queue that ended gives its last frames first.
  NextStatus pop(QueuedFrame& frame, std::chrono::milliseconds timeout);

  /// Whether it was closed with kStopped (or never opened).
  bool is_stopped();

  /// Lets no more frames through and wakes a waiting reader with kStopped or kEnd.
  void close(NextStatus reason);

 private:
  void give_back_all();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<QueuedFrame> places_;  ///< A circle of fixed size.
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  NextStatus closed_ = NextStatus::kStopped;  ///< kFrame while open.
};

}  // namespace striper::detail::v4l2
