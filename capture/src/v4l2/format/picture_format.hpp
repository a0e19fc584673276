// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/v4l2/v4l2_source.hpp>

#include "v4l2/device/video_device.hpp"
#include "v4l2/format/agreement.hpp"

namespace striper::detail::v4l2 {

/// Chooses and sets pixel format, size, order of fields and rate for the signal that is agreed on,
/// and writes them into `agreed`.
/// @throws Error naming the key, what was asked and what there is.
void choose_frame_format(const VideoDevice& device, const V4l2Options& options, Agreement& agreed);

/// Sets the pixel format again to what was agreed: another program may have changed it since.
/// @throws Error{kDevice} where it no longer takes it.
void set_format(const VideoDevice& device, const Agreement& agreement);

}  // namespace striper::detail::v4l2
