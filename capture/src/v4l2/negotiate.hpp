// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <linux/videodev2.h>
#include <opencv2/core/types.hpp>

#include <striper/core/frame.hpp>
#include <striper/v4l2/v4l2_source.hpp>

#include "v4l2/pixel_format.hpp"
#include "v4l2/video_device.hpp"

namespace striper::v4l2 {

/// What a device and striper agreed on.
struct Agreement {
  int input = 0;
  std::string input_name;
  v4l2_std_id standard = 0;  ///< 0: the input knows no television standard.
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
  bool is_woven() const noexcept { return V4L2_FIELD_IS_INTERLACED(field); }

  /// Which field of a picture is exposed first; the kernel's rule: an explicit order wins, 525-line
  /// television begins with the bottom field, everything else with the top field.
  Field first_field() const noexcept;

  cv::Size picture_size() const noexcept;  ///< With both fields.
  std::int64_t picture_period_ns() const noexcept;

  /// Rate, standard, field order, format: "NTSC 720x480 GREY, interlaced (bottom field first),
  /// ...".
  std::string describe() const;

  friend bool operator==(const Agreement&, const Agreement&) = default;
};

/// Sets a device to what is asked and chooses the rest.
/// @throws Error naming the key, what was asked and what there is.
Agreement negotiate(const VideoDevice& device, const V4l2Options& options);

/// Sets the pixel format again to what was agreed: another program may have changed it since.
/// @throws Error{kDevice} where it no longer takes it.
void set_format(const VideoDevice& device, const Agreement& agreement);

/// `ntsc`, `pal-60`, ... -> the kernel's bits. @return 0 for a word that is none.
v4l2_std_id standard_from_string(std::string_view word) noexcept;
std::string standard_to_string(v4l2_std_id standard);

/// The words for all standards among these bits.
std::vector<std::string> standards_to_strings(v4l2_std_id standards);

/// `interlaced-tb` <-> V4L2_FIELD_INTERLACED_TB; V4L2_FIELD_ANY for a word that is none.
std::uint32_t field_from_string(std::string_view word) noexcept;
std::string field_to_string(std::uint32_t field);

}  // namespace striper::v4l2
