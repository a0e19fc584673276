// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <linux/videodev2.h>

#include "v4l2/device/video_device.hpp"

// What a driver lists of the images that it has: formats, the sizes of each, the rates of those.
namespace striper::detail::v4l2 {

std::vector<v4l2_fmtdesc> list_formats(const VideoDevice& device);

/// The sizes of a format (its code), one by one or, as the only entry, a range.
std::vector<v4l2_frmsizeenum> list_sizes(const VideoDevice& device, std::uint32_t code);

/// The rates at one of the sizes that are listed one by one.
struct FrameRates {
  std::vector<double> listed_hz;  ///< As the driver lists them; empty where it has a range.
  double fastest_hz = 0.0;        ///< Of a range, too; 0 where the driver tells nothing.
};
FrameRates list_rates(const VideoDevice& device, std::uint32_t code,
                      const v4l2_frmsize_discrete& size);

}  // namespace striper::detail::v4l2
