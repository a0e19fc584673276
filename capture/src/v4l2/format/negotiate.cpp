// SPDX-License-Identifier: Apache-2.0
#include "v4l2/format/negotiate.hpp"

#include "v4l2/device/controls.hpp"
#include "v4l2/format/picture_format.hpp"

namespace striper::detail::v4l2 {

Agreement negotiate(const VideoDevice& device, const V4l2Options& options) {
  Agreement agreed;
  agreed.signal = choose_signal(device, options);
  choose_frame_format(device, options, agreed);
  set_controls(device, options.controls);
  agreed.exposure_ns = options.exposure_us > 0.0
                           ? set_exposure(device, options.exposure_us, options.events)
                           : read_exposure_ns(device);
  return agreed;
}

}  // namespace striper::detail::v4l2
