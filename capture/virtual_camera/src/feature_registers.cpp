// SPDX-License-Identifier: Apache-2.0
#include "feature_registers.hpp"

#include <utility>

#include "gige/pictures/pixel_layout.hpp"
#include "gige/protocol/gvcp.hpp"
#include "live/host_clock.hpp"

namespace striper::detail {
namespace {

using Registers = std::map<std::uint32_t, RegisterHooks>;

constexpr std::uint32_t kAnyWord = 0xffffffff;

// While frames stream their shape does not change.
bool is_locked(const CameraState& state) { return state.is_acquiring; }

cv::Size binned_sensor(const CameraState& state) {
  return {state.sensor.width / state.binning.width, state.sensor.height / state.binning.height};
}

bool try_region(CameraState& state, const cv::Rect& region) {
  const cv::Size all = binned_sensor(state);
  const bool fits = region.x >= 0 && region.y >= 0 && region.width > 0 && region.height > 0 &&
                    region.x + region.width <= all.width && region.y + region.height <= all.height;
  if (is_locked(state) || !fits || region.width % 4 != 0) return false;
  state.region = region;
  return true;
}

bool try_binning(CameraState& state, cv::Size binning) {
  const auto is_offered = [](int n) { return n == 1 || n == 2 || n == 4; };
  if (is_locked(state) || !is_offered(binning.width) || !is_offered(binning.height)) return false;
  state.binning = binning;
  state.region = cv::Rect(cv::Point(0, 0), binned_sensor(state));
  return true;
}

RegisterHooks plain(std::uint32_t& value, std::uint32_t low, std::uint32_t high) {
  return {[&value] { return value; },
          [&value, low, high](std::uint32_t wanted) {
            if (wanted < low || wanted > high) return false;
            value = wanted;
            return true;
          }};
}

RegisterHooks flag(bool& value) {
  return {[&value] { return value ? 1U : 0U; },
          [&value](std::uint32_t wanted) {
            value = wanted != 0;
            return wanted <= 1;
          }};
}

RegisterHooks fixed(std::uint32_t value) {
  return {[value] { return value; }, [value](std::uint32_t wanted) { return wanted == value; }};
}

void add_image_registers(Registers& registers, CameraState& s) {
  const auto u32 = [](int value) { return static_cast<std::uint32_t>(value); };
  const auto region_part = [&s, u32](int cv::Rect::*part) {
    return RegisterHooks{[&s, part, u32] { return u32(s.region.*part); },
                         [&s, part](std::uint32_t wanted) {
                           cv::Rect region = s.region;
                           region.*part = static_cast<int>(wanted);
                           return try_region(s, region);
                         }};
  };
  const auto binning_part = [&s, u32](int cv::Size::*part) {
    return RegisterHooks{[&s, part, u32] { return u32(s.binning.*part); },
                         [&s, part](std::uint32_t wanted) {
                           cv::Size binning = s.binning;
                           binning.*part = static_cast<int>(wanted);
                           return try_binning(s, binning);
                         }};
  };
  registers[kRegSensorWidth] = {[&s, u32] { return u32(s.sensor.width); }, nullptr};
  registers[kRegSensorHeight] = {[&s, u32] { return u32(s.sensor.height); }, nullptr};
  registers[kRegWidth] = region_part(&cv::Rect::width);
  registers[kRegHeight] = region_part(&cv::Rect::height);
  registers[kRegOffsetX] = region_part(&cv::Rect::x);
  registers[kRegOffsetY] = region_part(&cv::Rect::y);
  registers[kRegBinningHorizontal] = binning_part(&cv::Size::width);
  registers[kRegBinningVertical] = binning_part(&cv::Size::height);
  registers[kRegPixelFormat] = {[&s] { return s.pixel_format; },
                                [&s](std::uint32_t wanted) {
                                  const PixelLayout* const layout = find_layout(wanted);
                                  if (is_locked(s) || layout == nullptr) return false;
                                  s.pixel_format = wanted;
                                  return true;
                                }};
  registers[kRegPayloadSize] = {[&s] { return payload_bytes(s); }, nullptr};
  registers[kRegExposure] = plain(s.exposure_ns, 1'000, 1'000'000'000);
  registers[kRegRate] = plain(s.rate_mhz, 100, 1'000'000);
  registers[kRegGain] = plain(s.gain, 0, 24'000);
  registers[kRegBlackLevel] = plain(s.black_level, 0, 255);
}

void add_acquisition_registers(Registers& registers, CameraState& s, const RegisterActions& do_) {
  registers[kRegAcquisition] = {[&s] { return s.is_acquiring ? 1U : 0U; },
                                [acquire = do_.acquire](std::uint32_t wanted) {
                                  acquire(wanted != 0);
                                  return true;
                                }};
  registers[kRegAcquisitionMode] = fixed(0);
  registers[kRegTriggerSelector] = fixed(0);
  registers[kRegTriggerMode] = flag(s.is_triggered);
  registers[kRegTriggerSource] = {[&s] { return static_cast<std::uint32_t>(s.trigger_source); },
                                  [&s](std::uint32_t wanted) {
                                    s.trigger_source = static_cast<TriggerSource>(wanted);
                                    return wanted <=
                                           static_cast<std::uint32_t>(TriggerSource::kAction1);
                                  }};
  registers[kRegTriggerSoftware] = {[] { return 0U; },
                                    [trigger = do_.trigger](std::uint32_t) {
                                      trigger(TriggerSource::kSoftware);
                                      return true;
                                    }};
  registers[kRegActionSelector] = fixed(1);
  registers[gvcp::kActionGroupKey] = plain(s.action_group_key, 0, kAnyWord);
  registers[gvcp::kActionGroupMask] = plain(s.action_group_mask, 0, kAnyWord);
  registers[kRegLostPackets] = {do_.lost_ppm, [set = do_.set_lost_ppm](std::uint32_t wanted) {
                                  set(wanted);
                                  return wanted <= 1'000'000;
                                }};
}

void add_line_registers(Registers& registers, CameraState& s) {
  registers[kRegLineSelector] = plain(s.line, 0, kLines - 1);
  registers[kRegLineMode] = {[&s] { return s.line_is_output[s.line]; },
                             [&s](std::uint32_t wanted) {
                               // Line0 and Line1 are inputs by their wiring, the others outputs.
                               return wanted == s.line_is_output[s.line];
                             }};
  registers[kRegLineSource] = {[&s] { return static_cast<std::uint32_t>(s.sources[s.line]); },
                               [&s](std::uint32_t wanted) {
                                 if (s.line_is_output[s.line] == 0 || wanted > 3) return false;
                                 s.sources[s.line] = static_cast<LineSource>(wanted);
                                 s.lines_are_commanded = true;
                                 return true;
                               }};
  registers[kRegLineStatusAll] = {[&s] { return s.line_status(s.sources); }, nullptr};
  registers[kRegUserOutputSelector] = plain(s.user_output, 0, kUserOutputs - 1);
  registers[kRegUserOutputValue] = {[&s] { return s.user_outputs[s.user_output] ? 1U : 0U; },
                                    [&s](std::uint32_t wanted) {
                                      s.user_outputs[s.user_output] = wanted != 0;
                                      return wanted <= 1;
                                    }};
}

void add_sequencer_registers(Registers& registers, CameraState& s) {
  registers[kRegSequencerMode] = {[&s] { return s.sequencer_is_on ? 1U : 0U; },
                                  [&s](std::uint32_t wanted) {
                                    if (wanted > 1 || (wanted == 1 && s.sequencer_is_configured)) {
                                      return false;
                                    }
                                    s.sequencer_is_on = wanted == 1;
                                    return true;
                                  }};
  registers[kRegSequencerConfiguration] = flag(s.sequencer_is_configured);
  registers[kRegSequencerSet] = plain(s.sequencer_set, 0, kSequencerSets - 1);
  registers[kRegSequencerPath] = plain(s.sequencer_path, 0, 0);
  registers[kRegSequencerNext] = plain(s.sequencer_next, 0, kSequencerSets - 1);
  registers[kRegSequencerStart] = plain(s.sequencer_start, 0, kSequencerSets - 1);
  registers[kRegSequencerSave] = {
      [] { return 0U; },
      [&s](std::uint32_t) {
        if (!s.sequencer_is_configured) return false;
        s.sets[s.sequencer_set] = {s.sources, s.sequencer_next, s.exposure_ns};
        return true;
      }};
}

void add_chunk_registers(Registers& registers, CameraState& s) {
  registers[kRegChunkMode] = {[&s] { return s.chunk_mode ? 1U : 0U; },
                              [&s](std::uint32_t wanted) {
                                if (is_locked(s)) return false;
                                s.chunk_mode = wanted != 0;
                                return true;
                              }};
  registers[kRegChunkSelector] = plain(s.chunk, 0, 1);
  const auto selected = [&s]() -> bool& { return s.chunk == 0 ? s.line_chunk : s.encoder_chunk; };
  registers[kRegChunkEnable] = {[selected] { return selected() ? 1U : 0U; },
                                [selected](std::uint32_t wanted) {
                                  selected() = wanted != 0;
                                  return wanted <= 1;
                                }};
}

void add_ptp_registers(Registers& registers, CameraState& s) {
  registers[kRegPtpEnable] = {[&s] { return s.ptp_is_on ? 1U : 0U; },
                              [&s](std::uint32_t wanted) {
                                if (wanted == 1 && !s.ptp_is_on)
                                  s.ptp_since_ns = monotonic_now_ns();
                                s.ptp_is_on = wanted == 1;
                                return wanted <= 1;
                              }};
  registers[kRegPtpLatch] = {[] { return 0U; },
                             [&s](std::uint32_t) {
                               s.ptp_status = s.ptp_status_at(monotonic_now_ns());
                               return true;
                             }};
  registers[kRegPtpStatus] = {[&s] { return static_cast<std::uint32_t>(s.ptp_status); }, nullptr};
  registers[kRegIeee1588Status] = {
      [&s] { return static_cast<std::uint32_t>(s.ptp_status_at(monotonic_now_ns())); }, nullptr};
}

}  // namespace

std::uint32_t payload_bytes(const CameraState& state) {
  const PixelLayout& layout = *find_layout(state.pixel_format);
  const std::size_t image =
      layout.row_bytes(state.region.width) * static_cast<std::size_t>(state.region.height);
  constexpr std::size_t kChunkTail = 8;
  std::size_t chunks = 0;
  constexpr std::size_t kWord = 4 + kChunkTail;
  if (state.chunk_mode) {
    chunks = kChunkTail + (state.line_chunk ? kWord : 0) + (state.encoder_chunk ? kWord : 0);
  }
  return static_cast<std::uint32_t>(image + chunks);
}

Registers feature_registers(CameraState& state, const RegisterActions& actions) {
  Registers registers;
  add_image_registers(registers, state);
  add_acquisition_registers(registers, state, actions);
  add_line_registers(registers, state);
  add_sequencer_registers(registers, state);
  add_chunk_registers(registers, state);
  add_ptp_registers(registers, state);
  return registers;
}

}  // namespace striper::detail
