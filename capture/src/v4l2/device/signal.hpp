// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <linux/videodev2.h>

#include <striper/v4l2/v4l2_source.hpp>

#include "v4l2/device/video_device.hpp"

namespace striper::detail::v4l2 {

/// Where a device takes its signal from.
struct Signal {
  int input = 0;
  std::string input_name;    ///< Empty: the device has no inputs to choose from.
  v4l2_std_id standard = 0;  ///< 0: the input knows no television standard.

  friend bool operator==(const Signal&, const Signal&) = default;
};

/// Sets the input and the standard that are asked for, or finds out which they are.
/// @throws Error naming the key, what was asked and what there is; or saying what is wrong with the
///         signal.
Signal choose_signal(const VideoDevice& device, const V4l2Options& options);

/// All inputs that the device has, in order.
std::vector<v4l2_input> list_inputs(const VideoDevice& device);

/// What is wrong with an input's signal, as the middle of a sentence and with what to do; empty
/// when nothing is.
std::string signal_trouble(std::uint32_t input_status);

}  // namespace striper::detail::v4l2
