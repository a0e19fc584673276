// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <linux/videodev2.h>

#include <striper/core/event.hpp>

#include "v4l2/device/video_device.hpp"

namespace striper::detail::v4l2 {

inline constexpr double kExposureUnitUs = 100.0;  ///< V4L2_CID_EXPOSURE_ABSOLUTE counts 100 us.

/// One entry of a menu control.
struct MenuEntry {
  std::int64_t index = 0;
  std::string text;  ///< The number, for menus of numbers.
};

/// A control of the device that holds a single number.
struct Control {
  std::uint32_t id = 0;
  std::string name;  ///< As v4l2-ctl writes it: `exposure_time_absolute`.
  std::uint32_t type = 0;
  std::uint32_t flags = 0;
  std::int64_t minimum = 0;
  std::int64_t maximum = 0;
  std::uint64_t step = 0;
  std::int64_t default_value = 0;
  std::vector<MenuEntry> menu;
};

/// All controls that hold one number (no strings, arrays or structures), in the device's order.
std::vector<Control> list_controls(const VideoDevice& device);

/// @return 0 or the error number.
int read_control(const VideoDevice& device, const Control& control, std::int64_t& value);

/// Sets controls by name, automatic modes first so that what they guard can be set after them.
/// @throws Error{kUsage} on an unknown name or a value outside the control's bounds, naming both;
///         Error{kDevice} where the device refuses.
void set_controls(const VideoDevice& device, const std::map<std::string, std::string>& wanted);

/// Sets a fixed exposure, switching automatic exposure off.
/// @return what the device made of it, in nanoseconds.
/// @throws Error{kUnsupported} where it has no control for it.
std::int64_t set_exposure(const VideoDevice& device, double exposure_us, const EventPort& events);

/// The exposure that the device says it has; 0 where it does not say or chooses by itself.
std::int64_t read_exposure_ns(const VideoDevice& device);

}  // namespace striper::detail::v4l2
