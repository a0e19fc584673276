// SPDX-License-Identifier: Apache-2.0
#include "v4l2/format/agreement.hpp"

#include <cmath>

#include <fmt/format.h>

#include "v4l2/device/names.hpp"

namespace striper::detail::v4l2 {

Field Agreement::first_field() const noexcept {
  switch (field) {
    case V4L2_FIELD_INTERLACED_TB:
    case V4L2_FIELD_SEQ_TB:
    case V4L2_FIELD_TOP:
      return Field::kTop;
    case V4L2_FIELD_INTERLACED_BT:
    case V4L2_FIELD_SEQ_BT:
    case V4L2_FIELD_BOTTOM:
      return Field::kBottom;
    default:
      return (signal.standard & V4L2_STD_525_60) != 0 ? Field::kBottom : Field::kTop;
  }
}

cv::Size Agreement::frame_size() const noexcept {
  return {width, is_one_field_a_buffer() ? 2 * buffer_height : buffer_height};
}

std::size_t Agreement::buffer_bytes() const noexcept {
  const std::size_t row = format->row_bytes(width);
  // The last row may end where its pixels do.
  return row == 0 ? 1 : stride * static_cast<std::size_t>(buffer_height - 1) + row;
}

std::int64_t Agreement::frame_period_ns() const noexcept {
  return picture_rate_hz > 0.0 ? static_cast<std::int64_t>(std::llround(1e9 / picture_rate_hz)) : 0;
}

std::string Agreement::describe() const {
  const cv::Size size = frame_size();
  std::string text;
  if (!signal.input_name.empty())
    text += fmt::format("input {} ({}), ", signal.input, signal.input_name);
  if (signal.standard != 0) text += fmt::format("{}, ", standard_to_string(signal.standard));
  text += fmt::format("{}x{} {}", size.width, size.height, fourcc_to_string(format->fourcc));
  if (field != V4L2_FIELD_NONE) {
    text += fmt::format(", {} ({} field first)", field_to_string(field),
                        first_field() == Field::kTop ? "top" : "bottom");
  }
  if (picture_rate_hz > 0.0) text += fmt::format(", {:.2f} frames/s", picture_rate_hz);
  return text;
}

}  // namespace striper::detail::v4l2
