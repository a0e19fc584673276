// SPDX-License-Identifier: Apache-2.0
#include "v4l2/device/signal.hpp"

#include <cerrno>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "v4l2/device/names.hpp"

namespace striper::detail::v4l2 {
namespace {

bool has_standard(const v4l2_input& input) {
  return (input.capabilities & V4L2_IN_CAP_STD) != 0 || input.std != 0;
}

v4l2_input find_input(const VideoDevice& device, const std::vector<v4l2_input>& inputs,
                      const std::string& wanted) {
  for (const v4l2_input& input : inputs) {
    if (wanted == std::to_string(input.index) || is_same_word(wanted, text_of(input.name))) {
      return input;
    }
  }
  std::vector<std::string> names;
  names.reserve(inputs.size());
  for (const v4l2_input& input : inputs)
    names.push_back(fmt::format("{} ({})", input.index, text_of(input.name)));
  device.fail(ErrorKind::kUsage,
              fmt::format("input={} - '{}' has {}", wanted, device.card(), fmt::join(names, ", ")));
}

v4l2_input choose_input(const VideoDevice& device, const std::string& wanted) {
  const std::vector<v4l2_input> inputs = list_inputs(device);
  if (inputs.empty()) return {};  // Cameras of the simplest kind have no inputs to choose from.
  int current = 0;
  if (!wanted.empty()) {
    current = static_cast<int>(find_input(device, inputs, wanted).index);
    device.require(VIDIOC_S_INPUT, current, fmt::format("choose input {}", wanted));
  } else if (device.attempt(VIDIOC_G_INPUT, current) != 0) {
    current = 0;
  }
  v4l2_input input{};
  input.index = static_cast<std::uint32_t>(current);
  device.require(VIDIOC_ENUMINPUT, input, fmt::format("ask about input {}", current));
  return input;
}

v4l2_std_id detect_standard(const VideoDevice& device, const v4l2_input& input, bool is_asked_for) {
  v4l2_std_id seen = 0;
  const int error = device.attempt(VIDIOC_QUERYSTD, seen);
  seen &= input.std;
  const bool is_decided = ((seen & V4L2_STD_525_60) == 0) != ((seen & V4L2_STD_625_50) == 0);
  if (error == 0 && is_decided) return seen;

  const std::string trouble = signal_trouble(input.status);
  if (is_asked_for || error == ENOLINK || !trouble.empty()) {
    device.fail(
        ErrorKind::kDevice,
        fmt::format("cannot tell the standard of input {} ('{}'): it {}", input.index,
                    text_of(input.name),
                    trouble.empty() ? "may be any of several; say standard=ntsc or standard=pal"
                                    : trouble));
  }
  v4l2_std_id current = 0;
  device.require(VIDIOC_G_STD, current, "ask for the standard");
  return current;
}

v4l2_std_id choose_standard(const VideoDevice& device, const v4l2_input& input,
                            const std::string& wanted) {
  if (!has_standard(input)) {
    if (!wanted.empty() && wanted != "auto") {
      device.fail(
          ErrorKind::kUnsupported,
          fmt::format("standard={} - input {} ('{}') is no television input; leave it out or "
                      "choose another input=",
                      wanted, input.index, text_of(input.name)));
    }
    return 0;
  }
  v4l2_std_id standard = 0;
  if (wanted.empty() || wanted == "auto") {
    standard = detect_standard(device, input, wanted == "auto");
  } else {
    standard = standard_from_string(wanted) & input.std;
  }
  if (standard == 0) {
    device.fail(ErrorKind::kUnsupported,
                fmt::format("standard={} - input {} ('{}') has auto, {}", wanted, input.index,
                            text_of(input.name), fmt::join(standards_to_strings(input.std), ", ")));
  }
  device.require(VIDIOC_S_STD, standard,
                 fmt::format("set standard={}", standard_to_string(standard)));
  return standard;
}

void require_signal(const VideoDevice& device, std::uint32_t index) {
  v4l2_input input{};
  input.index = index;
  if (device.attempt(VIDIOC_ENUMINPUT, input) != 0) return;
  if (const std::string trouble = signal_trouble(input.status); !trouble.empty()) {
    device.fail(ErrorKind::kDevice,
                fmt::format("input {} ('{}') {} (signal=ignore opens it all the same)", index,
                            text_of(input.name), trouble));
  }
}

}  // namespace

Signal choose_signal(const VideoDevice& device, const V4l2Options& options) {
  const v4l2_input input = choose_input(device, options.input);
  const v4l2_std_id standard = choose_standard(device, input, options.standard);
  if (options.require_signal) require_signal(device, input.index);
  return {static_cast<int>(input.index), text_of(input.name), standard};
}

std::vector<v4l2_input> list_inputs(const VideoDevice& device) {
  constexpr std::uint32_t kAtMost = 64;
  std::vector<v4l2_input> inputs;
  v4l2_input input{};
  while (input.index < kAtMost && device.attempt(VIDIOC_ENUMINPUT, input) == 0) {
    inputs.push_back(input);
    const std::uint32_t following = input.index + 1;
    input = {};
    input.index = following;
  }
  return inputs;
}

std::string signal_trouble(std::uint32_t input_status) {
  if ((input_status & V4L2_IN_ST_NO_POWER) != 0) return "has no power: switch the camera on";
  if ((input_status & V4L2_IN_ST_NO_SIGNAL) != 0)
    return "has no signal: look at the cable and whether the camera is on";
  constexpr std::uint32_t kUnlocked =
      V4L2_IN_ST_NO_H_LOCK | V4L2_IN_ST_NO_V_LOCK | V4L2_IN_ST_NO_STD_LOCK | V4L2_IN_ST_NO_SYNC;
  if ((input_status & kUnlocked) != 0)
    return "has a signal that the grabber cannot lock to: look at the cable, its termination (75 "
           "ohm) and whether standard= fits the camera";
  return {};
}

}  // namespace striper::detail::v4l2
