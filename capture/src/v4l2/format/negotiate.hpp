// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/v4l2/v4l2_source.hpp>

#include "v4l2/device/video_device.hpp"
#include "v4l2/format/agreement.hpp"

namespace striper::detail::v4l2 {

/// Sets a device to what is asked and chooses the rest: input and standard, pixel format, size and
/// order of fields, rate, controls.
/// @throws Error naming the key, what was asked and what there is.
Agreement negotiate(const VideoDevice& device, const V4l2Options& options);

}  // namespace striper::detail::v4l2
