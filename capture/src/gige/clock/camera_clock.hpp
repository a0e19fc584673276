// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include <striper/capture/clock_map.hpp>

#include "gige/protocol/feature_access.hpp"

namespace striper::detail {

/// The time of a camera's frames on this host's clocks.
///
/// Where the camera latches its timestamp on demand (GigE Vision 1.2, 27.14) its clock is compared
/// with ours four times a second, otherwise by the arrival of frames. That happens on a thread of
/// its own: Aravis asks a camera that is gone for seconds, longer than its loss may stay unnoticed.
///
/// Threads: one calls `start` and `stop`, one those of frames; `rate` any.
class CameraClock {
 public:
  /// @param features of the camera; both must outlive this. @param features_mutex is held while
  /// they are used. @param address 0: nothing can be latched (USB). @param follows_ptp the camera
  /// was told to follow the network's time.
  CameraClock(const FeatureAccess& features, std::mutex& features_mutex, std::uint32_t address,
              bool follows_ptp)
      : features_(features),
        features_mutex_(features_mutex),
        address_(address),
        follows_ptp_(follows_ptp) {}
  CameraClock(const CameraClock&) = delete;
  CameraClock& operator=(const CameraClock&) = delete;
  ~CameraClock() { stop(); }

  /// Forgets what was known, compares the clocks (some 30 ms) and goes on doing so.
  void start();

  /// Waits for a comparison that is under way: for seconds where the camera is gone.
  void stop() noexcept;

  /// Start of a frame's exposure on CLOCK_MONOTONIC. @param device_ns the camera's own timestamp,
  /// 0 if it has none. @param arrival_ns of its first packet.
  std::int64_t exposure_start_ns(std::int64_t device_ns, std::int64_t arrival_ns,
                                 std::int64_t exposure_ns);

  /// UTC minus CLOCK_MONOTONIC at that moment: from PTP while the camera has its time, otherwise
  /// the host's own.
  std::int64_t utc_offset_ns(std::int64_t device_ns, std::int64_t start_ns) const;

  /// Host seconds per camera second.
  double rate() const;

 private:
  void find_latch();
  bool latch(std::int64_t& device_ns, std::int64_t& host_ns, std::int64_t& uncertainty_ns);
  void run();
  void follow();
  void follow_ptp();

  const FeatureAccess& features_;
  std::mutex& features_mutex_;
  std::uint32_t address_;
  bool follows_ptp_;

  std::thread thread_;
  std::string ptp_status_;  // the thread's
  std::uint64_t tick_frequency_hz_ = 0;
  std::atomic<bool> has_ptp_time_ = false;
  std::atomic<bool> has_latch_ = false;

  mutable std::mutex mutex_;  // of all that follows
  std::condition_variable ends_;
  bool is_ending_ = false;
  ClockMap map_;
  bool has_disagreed_ = false;  // a frame's time with the latched ones, since the last of those
  int disagreements_ = 0;       // comparisons in a row between which that happened
  std::int64_t smallest_round_trip_ns_ = 0;
};

}  // namespace striper::detail
