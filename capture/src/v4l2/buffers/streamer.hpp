// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include "capture/frame_counts.hpp"
#include "live/reopening.hpp"
#include "v4l2/buffers/buffer_ring.hpp"
#include "v4l2/buffers/exposure_clock.hpp"
#include "v4l2/buffers/picture_queue.hpp"
#include "v4l2/format/agreement.hpp"

namespace striper::detail::v4l2 {

/// Moves frames from the device to the queue on a thread of its own, and keeps the device alive:
/// closes and opens it again when it fails, stalls or vanishes.
class Streamer {
 public:
  /// Starts to stream. @throws Error where the device refuses.
  Streamer(std::unique_ptr<VideoDevice> device, const V4l2Options& options,
           const Agreement& agreement, FrameQueue& queue, FrameCounts& counts);
  Streamer(const Streamer&) = delete;
  Streamer& operator=(const Streamer&) = delete;
  ~Streamer() { finish(); }

  /// Stops the thread and the stream.
  /// @return the device, still open; empty where it was lost.
  std::unique_ptr<VideoDevice> finish();

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  void wait_for_frame();
  void take_all();
  void accept(const FilledBuffer& filled);
  void judge(const FilledBuffer& filled, QueuedFrame& frame);
  void check_signal();
  void ask_for_signal();
  void lose(const std::string& reason);
  void try_again();
  void open_again();
  void end();
  void connect();

  const V4l2Options& options_;
  const Agreement& agreement_;
  FrameQueue& queue_;
  FrameCounts& counts_;
  std::shared_ptr<VideoCalls> calls_;
  std::unique_ptr<VideoDevice> device_;
  std::shared_ptr<BufferRing> ring_;
  ExposureClock clock_;
  int wake_fd_ = -1;

  Clock::time_point last_frame_;
  Reopening reopening_;

  bool checks_signal_ = false;
  Clock::duration signal_answer_{0};  ///< What the quickest one took since the device was opened.
  Clock::time_point signal_asked_at_;
  bool has_signal_ = true;
  std::int64_t signal_since_ns_ = 0;  ///< When it was seen to be back.

  std::atomic<bool> is_stopping_{false};
  bool has_ended_ = false;
  std::thread thread_;
};

/// What the clock must know of a stream.
ExposureClock::Stream clock_stream(const Agreement& agreement, const V4l2Options& options);

/// Exposures in a frame: 2 where it has both fields.
int exposures_per_picture(const Agreement& agreement) noexcept;

}  // namespace striper::detail::v4l2
