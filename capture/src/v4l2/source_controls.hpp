// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include <opencv2/core/types.hpp>

#include <striper/core/controls.hpp>

#include "v4l2/device/video_device.hpp"

namespace striper::detail::v4l2 {

/// The controls of a source on a device: `exposure_us`, `region` (read only), then whatever the
/// device has, by the names that v4l2-ctl shows. V4L2 gives a gain no unit, so there is no
/// `gain_db`.
///
/// Each call opens the device for itself, which the kernel allows beside a stream: a control can be
/// set whoever streams, and while a lost device is being waited for it is an error.
/// @param on_exposure is told the exposure after every change, in nanoseconds; 0: not known.
Controls make_controls(const VideoDevice& opened, cv::Size image,
                       std::function<void(std::int64_t)> on_exposure);

}  // namespace striper::detail::v4l2
