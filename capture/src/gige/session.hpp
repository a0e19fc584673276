// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <striper/gige/gige_options.hpp>
#include <striper/gige/gige_source.hpp>

#include "gige/clock/camera_clock.hpp"
#include "gige/control/camera_setup.hpp"
#include "gige/control/laser_lines.hpp"
#include "gige/pictures/frame_pool.hpp"
#include "gige/protocol/find_camera.hpp"

namespace striper::detail {

/// One camera from opening to closing: set up, streaming, its clock and its lasers. It does not
/// heal: when the camera is lost another session is opened.
///
/// Threads: Aravis' stream thread fills buffers; a conductor thread triggers, where the host does;
/// the clock has one of its own; `pop` is called by one thread, `check_alive` by another.
class Session {
 public:
  /// Opens the camera, turns its lasers off and sets it up. @throws Error.
  explicit Session(const GigeOptions& options);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session();

  const FrameSetup& setup() const noexcept { return setup_; }
  const std::string& description() const noexcept { return opened_.description; }

  /// For the controls, from any thread, while it streams too.
  template <typename Action>
  auto with_features(Action action) {
    const std::lock_guard lock(features_mutex_);
    return action(features_);
  }
  void set_exposure_us(double exposure_us);  ///< @throws Error{kUsage, kDevice}.
  std::int64_t exposure_ns() const noexcept { return exposure_ns_; }  ///< Of a bracket the longest.
  bool has_lasers() const noexcept { return lasers_.is_used(); }
  bool are_lasers_on() const noexcept { return lasers_on_; }
  /// Off: dark whatever the pattern says, until they are on again. @throws Error{kDevice}.
  void switch_lasers(bool on);

  /// What the encoder showed at a frame; empty where it was not asked for.
  std::optional<std::int64_t> encoder_counts(const PoolSlot& slot) const;

  /// Begins to stream. @param wake is called when a buffer is ready or the camera is lost, from
  /// any thread. @throws Error.
  void start(std::function<void()> wake);

  /// Stops streaming and turns the lasers off; those of a lost camera as `darken` does.
  void stop() noexcept;

  /// Turns the lasers off of a camera that is lost but answers: with our control of it, or taking
  /// that for a moment where nobody has it. Tells where another program has it. Does nothing where
  /// that is done; blocks for half a second where the camera is silent.
  void darken() noexcept;

  /// The next buffer, whatever is in it; nullptr if there is none. The caller gives it back to the
  /// pool or leases it.
  PoolSlot* pop();
  FramePool& pool() noexcept { return *pool_; }

  /// Asks the camera whether it is there and ours. Blocks at most 1.2 s.
  void check_alive();
  bool is_lost() const noexcept { return is_lost_; }
  std::string loss() const;

  /// Start of the exposure on CLOCK_MONOTONIC. @param exposure_ns how long it was.
  std::int64_t exposure_start_ns(const PoolSlot& slot, std::int64_t exposure_ns);

  /// UTC minus CLOCK_MONOTONIC at that moment: from PTP while the camera has its time, otherwise
  /// the host's own.
  std::int64_t utc_offset_ns(const PoolSlot& slot, std::int64_t start_ns) const;

  /// What lit a frame. @param since_start number of its exposure since acquisition start.
  Illumination illumination(const PoolSlot& slot, std::uint64_t since_start);

  /// Number of the exposure since start, where the host triggers and so knows better than the
  /// camera's block id.
  bool numbers_by_trigger() const noexcept { return is_triggered_by_host_; }

  /// Adds this session's share, of a stream that was stopped as well.
  void add_to(GigeStatistics& sum) const;
  std::uint64_t overrun() const noexcept { return overrun_; }

  std::int64_t last_arrival_ns() const noexcept { return last_arrival_ns_; }

 private:
  static void on_stream_event(void* self, ArvStreamCallbackType type, ArvBuffer* buffer);
  static void on_control_lost(ArvDevice* device, void* self);
  void on_buffer_done(ArvBuffer* buffer);
  int enough_buffers(std::size_t payload_bytes) const noexcept;
  void tune_stream();
  void count_stream(GigeStatistics& sum) const;
  void conduct();
  std::chrono::nanoseconds frame_patience(std::size_t payload_bytes) const;
  void trigger_once(std::uint64_t number);
  void lose(const std::string& why);
  Access ask() const;
  bool may_command(const Access& access);
  void begin_streaming();
  void close_device() noexcept;

  GigeOptions options_;
  OpenCamera opened_;
  std::string holder_;  // we, as the camera knows us; empty if it does not tell
  FeatureAccess features_;
  LaserLines lasers_;
  std::mutex features_mutex_;  // of the feature tree, which several threads use
  CameraClock clock_;
  FrameSetup setup_;
  bool is_triggered_by_host_ = false;
  bool has_line_chunk_ = false;
  const char* encoder_value_ = nullptr;  // the chunk's feature
  int packet_bytes_ = 0;
  gulong control_lost_handler_ = 0;
  int tries_to_darken_ = 3;  // so often a camera that answers may refuse to

  std::shared_ptr<FramePool> pool_;
  GPtr<ArvStream> stream_;
  GPtr<ArvChunkParser> chunks_;
  std::function<void()> wake_;
  int socket_buffer_bytes_ = 0;
  GigeStatistics counted_;  // of the stream that was stopped last

  mutable std::mutex mutex_;
  std::condition_variable buffer_done_;
  std::thread conductor_;
  bool is_conducting_ = false;
  bool is_awaiting_ = false;  // a trigger was sent and its frame has not come
  std::uint64_t arrivals_ = 0;
  std::uint64_t popped_ = 0;
  struct Trigger {
    std::uint64_t number = 0;
    Illumination commanded;
    std::int64_t sent_ns = 0;
  };
  Trigger trigger_;                          // the latest
  Trigger overdue_;                          // the one before, whose frame was waited for in vain
  std::chrono::nanoseconds frame_within_{};  // after a software trigger
  std::string loss_;

  std::atomic<std::int64_t> exposure_ns_ = 0;
  std::atomic<bool> lasers_on_ = true;
  std::atomic<bool> were_switched_ = false;  // by hand: the sequencer's phase is lost
  bool is_armed_ = false;                    // between start and stop; of `features_mutex_`
  std::atomic<bool> is_lost_ = false;
  std::atomic<std::uint64_t> overrun_ = 0;
  std::atomic<std::int64_t> last_arrival_ns_ = 0;
};

}  // namespace striper::detail
