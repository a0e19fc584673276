// SPDX-License-Identifier: Apache-2.0
#include "gige/clock/camera_clock.hpp"

#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/event.hpp>

#include "gige/clock/ptp_clock.hpp"
#include "gige/protocol/gvcp.hpp"
#include "gige/protocol/gvcp_client.hpp"
#include "live/host_clock.hpp"

namespace striper::detail {
namespace {

using namespace std::chrono_literals;

constexpr auto kCompareEvery = 250ms;
constexpr auto kAnswersWithin = 400ms;
constexpr std::int64_t kImplausible_ns = 2'000'000'000;

}  // namespace

void CameraClock::start() {
  stop();
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = false;
    map_.reset();
    has_disagreed_ = false;
    disagreements_ = 0;
  }
  find_latch();
  if (has_latch_ || follows_ptp_) thread_ = std::thread(&CameraClock::run, this);
}

void CameraClock::stop() noexcept {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  ends_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void CameraClock::run() {
  std::unique_lock lock(mutex_);
  while (!ends_.wait_for(lock, kCompareEvery, [this] { return is_ending_; })) {
    lock.unlock();
    // Nobody else waits for a camera that is gone, but whoever ends this may.
    if (read_register(address_, gvcp::kControlPrivilege, kAnswersWithin)) {
      follow_ptp();
      follow();
    }
    lock.lock();
  }
}

bool CameraClock::latch(std::int64_t& device_ns, std::int64_t& host_ns,
                        std::int64_t& uncertainty_ns) {
  constexpr guint32 kLatch = 2;
  CallError error;
  const std::int64_t before_ns = monotonic_now_ns();
  arv_device_write_register(features_.device(), gvcp::kTimestampControl, kLatch, error.slot());
  const std::int64_t after_ns = monotonic_now_ns();
  guint32 high = 0;
  guint32 low = 0;
  if (!error) {
    arv_device_read_register(features_.device(), gvcp::kTimestampHigh, &high, error.slot());
  }
  if (!error) {
    arv_device_read_register(features_.device(), gvcp::kTimestampLow, &low, error.slot());
  }
  if (error) return false;
  const std::uint64_t ticks = (static_cast<std::uint64_t>(high) << 32) | low;
  const std::uint64_t f = tick_frequency_hz_;
  constexpr std::uint64_t kNs = 1'000'000'000;
  device_ns = static_cast<std::int64_t>(ticks / f * kNs + (ticks % f) * kNs / f);
  host_ns = before_ns + (after_ns - before_ns) / 2;
  uncertainty_ns = after_ns - before_ns;
  return true;
}

void CameraClock::find_latch() {
  has_latch_ = false;
  if (address_ == 0) return;
  CallError error;
  tick_frequency_hz_ =
      arv_gv_device_get_timestamp_tick_frequency(ARV_GV_DEVICE(features_.device()), error.slot());
  if (error || tick_frequency_hz_ == 0 || tick_frequency_hz_ > 1'000'000'000) return;
  std::int64_t first_device = 0;
  std::int64_t first_host = 0;
  std::int64_t device = 0;
  std::int64_t host = 0;
  std::int64_t uncertainty = 0;
  if (!latch(first_device, first_host, uncertainty)) return;
  std::this_thread::sleep_for(20ms);
  if (!latch(device, host, uncertainty)) return;
  // A latch that does not run with the time is not implemented.
  const double rate =
      static_cast<double>(device - first_device) / static_cast<double>(host - first_host);
  if (rate < 0.9 || rate > 1.1) return;
  has_latch_ = true;
  {
    const std::lock_guard lock(mutex_);
    smallest_round_trip_ns_ = uncertainty;
  }
  for (int i = 0; i < 4; ++i) follow();
}

/// The clock's map needs no change for PTP: it goes on, and a step into PTP's time is a step.
void CameraClock::follow_ptp() {
  if (!follows_ptp_) return;
  std::string status;
  try {
    const std::lock_guard lock(features_mutex_);
    status = ptp_status(features_);
  } catch (const Error&) {
    return;  // whether the camera is lost is asked elsewhere
  }
  has_ptp_time_ = is_ptp_time(status);
  if (status == ptp_status_) return;
  ptp_status_ = status;
  features_.events().send(
      {has_ptp_time_ ? Severity::kInfo : Severity::kWarning, "clock_reference",
       fmt::format("{}: PTP is {}: times of day are {}", features_.device_name(),
                   status.empty() ? "not told of" : status,
                   has_ptp_time_ ? "PTP's" : "this host's")});
}

void CameraClock::follow() {
  std::int64_t device = 0;
  std::int64_t host = 0;
  std::int64_t uncertainty = 0;
  if (!has_latch_ || !latch(device, host, uncertainty)) return;
  const std::lock_guard lock(mutex_);
  smallest_round_trip_ns_ = std::min(smallest_round_trip_ns_, uncertainty);
  // A slow round trip tells little; the first one must do, though.
  const bool is_good = uncertainty < 2 * smallest_round_trip_ns_ + 200'000;
  if (is_good || !map_.is_ready()) map_.observe(device, host);
  disagreements_ = has_disagreed_ ? disagreements_ + 1 : 0;
  has_disagreed_ = false;
}

std::int64_t CameraClock::exposure_start_ns(std::int64_t device_ns, std::int64_t arrival_ns,
                                            std::int64_t exposure_ns) {
  const std::lock_guard lock(mutex_);
  if (has_latch_ && map_.is_ready()) {
    const std::int64_t start_ns = map_.to_host(device_ns);
    const bool agrees =
        start_ns <= arrival_ns + 1'000'000 && arrival_ns - start_ns < kImplausible_ns;
    if (agrees) return start_ns;
    // A clock that stepped (into PTP's time, say) agrees again after it was compared once or twice.
    has_disagreed_ = true;
    if (disagreements_ < 8) return arrival_ns - exposure_ns;
    features_.events().send(
        {"timestamps_unusable",
         fmt::format("{}: its frames' timestamps are not of the clock that it latches; times are "
                     "taken from the packets' arrival",
                     features_.device_name())});
    has_latch_ = false;
    map_.reset();
  }
  if (device_ns == 0) return arrival_ns - exposure_ns;
  map_.observe(device_ns, arrival_ns - exposure_ns);
  return map_.to_host(device_ns);
}

std::int64_t CameraClock::utc_offset_ns(std::int64_t device_ns, std::int64_t start_ns) const {
  const std::int64_t host_offset_ns = utc_offset_now_ns();
  if (!has_ptp_time_) return host_offset_ns;
  const auto utc_ns = utc_of_ptp(device_ns, start_ns + host_offset_ns);
  return utc_ns ? *utc_ns - start_ns : host_offset_ns;
}

double CameraClock::rate() const {
  const std::lock_guard lock(mutex_);
  return map_.rate();
}

}  // namespace striper::detail
