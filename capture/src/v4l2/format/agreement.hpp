// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include <linux/videodev2.h>
#include <opencv2/core/types.hpp>

#include <striper/core/frame.hpp>

#include "v4l2/device/signal.hpp"
#include "v4l2/format/pixel_format.hpp"

namespace striper::detail::v4l2 {

/// What a device and striper agreed on.
struct Agreement {
  Signal signal;
  const PixelFormat* format = nullptr;
  std::uint32_t field = V4L2_FIELD_NONE;
  int width = 0;
  int buffer_height = 0;  ///< Rows of one buffer: one field's for `alternate`.
  std::size_t stride = 0;
  int planes = 1;
  double picture_rate_hz = 0.0;  ///< 0 if the driver does not say.
  std::int64_t exposure_ns = 0;  ///< 0 if unknown.

  bool is_one_field_a_buffer() const noexcept { return V4L2_FIELD_HAS_T_OR_B(field); }
  bool is_sequential() const noexcept { return V4L2_FIELD_IS_SEQUENTIAL(field); }
  bool is_interlaced() const noexcept { return V4L2_FIELD_IS_INTERLACED(field); }

  /// Which field of a frame is exposed first; the kernel's rule: an explicit order wins, 525-line
  /// television begins with the bottom field, everything else with the top field.
  Field first_field() const noexcept;

  cv::Size frame_size() const noexcept;  ///< With both fields.

  /// What a buffer must hold to be a whole image, bytes; 1 where the size is the image's own.
  std::size_t buffer_bytes() const noexcept;

  std::int64_t frame_period_ns() const noexcept;

  /// Rate, standard, field order, format: "NTSC 720x480 GREY, interlaced (bottom field first),
  /// ...".
  std::string describe() const;

  friend bool operator==(const Agreement&, const Agreement&) = default;
};

}  // namespace striper::detail::v4l2
