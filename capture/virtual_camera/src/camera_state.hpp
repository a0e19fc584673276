// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include <opencv2/core/types.hpp>

namespace striper::detail {

inline constexpr int kLines = 4;           // Line0 to Line3
inline constexpr int kFirstLaserLine = 2;  // Line2 fires laser 0
inline constexpr int kUserOutputs = 2;
inline constexpr int kSequencerSets = 16;

enum class LineSource : std::uint32_t { kOff, kExposureActive, kUserOutput1, kUserOutput2 };
enum class TriggerSource : std::uint32_t { kSoftware, kLine1, kAction1 };

enum class PtpStatus : std::uint32_t { kDisabled = 3, kListening = 4, kSlave = 9 };  // IEEE 1588

using LineSources = std::array<LineSource, kLines>;

struct SequencerSet {
  LineSources sources{};
  std::uint32_t next = 0;
  std::uint32_t exposure_ns = 0;
};

/// Everything that a client can set, as the camera's registers hold it.
struct CameraState {
  cv::Size sensor;
  cv::Size binning{1, 1};
  cv::Rect region;  // of the binned image
  std::uint32_t pixel_format = 0;

  std::uint32_t exposure_ns = 1'000'000;
  std::uint32_t rate_mhz = 30'000;
  std::uint32_t gain = 0;
  std::uint32_t black_level = 0;

  bool is_acquiring = false;
  bool is_triggered = false;
  TriggerSource trigger_source = TriggerSource::kSoftware;
  std::uint32_t action_group_key = 0;
  std::uint32_t action_group_mask = 0;

  std::uint32_t line = 0;
  std::array<std::uint32_t, kLines> line_is_output{0, 0, 1, 1};
  LineSources sources{};
  bool lines_are_commanded = false;  // a client has set a LineSource
  std::uint32_t user_output = 0;
  std::array<bool, kUserOutputs> user_outputs{};

  bool sequencer_is_on = false;
  bool sequencer_is_configured = false;
  std::uint32_t sequencer_set = 0;
  std::uint32_t sequencer_start = 0;
  std::uint32_t sequencer_next = 0;
  std::uint32_t sequencer_path = 0;
  std::array<SequencerSet, kSequencerSets> sets{};

  bool ptp_is_on = false;
  std::int64_t ptp_since_ns = 0;                // of CLOCK_MONOTONIC
  PtpStatus ptp_status = PtpStatus::kDisabled;  // as it was latched last

  bool chunk_mode = false;
  std::uint32_t chunk = 0;
  bool line_chunk = false;
  bool encoder_chunk = false;

  /// The lines' state during an exposure with these sources, bit n for Line n.
  std::uint32_t line_status(const LineSources& at) const noexcept {
    std::uint32_t status = 0;
    for (int i = 0; i < kLines; ++i) {
      const LineSource source = at[static_cast<std::size_t>(i)];
      const bool is_high = source == LineSource::kExposureActive ||
                           (source == LineSource::kUserOutput1 && user_outputs[0]) ||
                           (source == LineSource::kUserOutput2 && user_outputs[1]);
      if (is_high) status |= 1U << i;
    }
    return status;
  }

  /// Following the network's time takes a moment.
  PtpStatus ptp_status_at(std::int64_t monotonic_ns) const noexcept {
    constexpr std::int64_t kToLock_ns = 500'000'000;
    if (!ptp_is_on) return PtpStatus::kDisabled;
    return monotonic_ns - ptp_since_ns < kToLock_ns ? PtpStatus::kListening : PtpStatus::kSlave;
  }

  /// A line would fire a laser in the next exposure, or in one that the sequencer comes to.
  bool is_laser_armed() const noexcept {
    const auto fires = [this](const LineSources& at) {
      return (line_status(at) >> kFirstLaserLine) != 0;
    };
    const bool any_set_fires =
        std::any_of(sets.begin(), sets.end(), [&](const auto& set) { return fires(set.sources); });
    return fires(sources) || (sequencer_is_on && any_set_fires);
  }

  void lines_off() noexcept {
    sources.fill(LineSource::kOff);
    user_outputs.fill(false);
    sequencer_is_on = false;
  }
};

}  // namespace striper::detail
