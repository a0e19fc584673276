// SPDX-License-Identifier: Apache-2.0
#include "v4l2/format/picture_format.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "v4l2/device/names.hpp"
#include "v4l2/format/picture_lists.hpp"

namespace striper::detail::v4l2 {
namespace {

const PixelFormat& choose_format(const VideoDevice& device, const std::string& wanted) {
  const std::vector<v4l2_fmtdesc> offered = list_formats(device);
  const auto is_offered = [&](std::uint32_t code) {
    return std::any_of(offered.begin(), offered.end(),
                       [&](const v4l2_fmtdesc& one) { return one.pixelformat == code; });
  };
  std::vector<std::string> usable;
  for (const PixelFormat& format : pixel_formats()) {
    if (!is_offered(format.fourcc)) continue;
    if (wanted.empty()) return format;
    usable.push_back(fourcc_to_string(format.fourcc));
  }
  if (const PixelFormat* const format = find_pixel_format(fourcc_from_string(wanted));
      format != nullptr && is_offered(format->fourcc)) {
    return *format;
  }
  if (usable.empty()) {
    std::vector<std::string> names;
    names.reserve(offered.size());
    for (const v4l2_fmtdesc& one : offered) names.push_back(fourcc_to_string(one.pixelformat));
    device.fail(ErrorKind::kUnsupported,
                fmt::format("'{}' has no pixel format that striper knows; it has {}", device.card(),
                            fmt::join(names, ", ")));
  }
  device.fail(ErrorKind::kUnsupported, fmt::format("format={} - '{}' has {}", wanted, device.card(),
                                                   fmt::join(usable, ", ")));
}

// The largest size that still comes at 15 frames a second; where there is no list, what is set.
cv::Size choose_size(const VideoDevice& device, std::uint32_t code, cv::Size current) {
  constexpr double kEnough_hz = 15.0;
  cv::Size best;
  for (const v4l2_frmsizeenum& size : list_sizes(device, code)) {
    if (size.type != V4L2_FRMSIZE_TYPE_DISCRETE) return current;
    const double rate_hz = list_rates(device, code, size.discrete).fastest_hz;
    const cv::Size candidate(static_cast<int>(size.discrete.width),
                             static_cast<int>(size.discrete.height));
    const bool is_fast = rate_hz == 0.0 || rate_hz >= kEnough_hz;
    if (is_fast && candidate.area() > best.area()) best = candidate;
  }
  return best.area() > 0 ? best : current;
}

v4l2_format make_format(const VideoDevice& device, std::uint32_t code, cv::Size size,
                        std::uint32_t field) {
  v4l2_format format{};
  format.type = device.buffer_type();
  if (device.is_multiplanar()) {
    format.fmt.pix_mp.width = static_cast<std::uint32_t>(size.width);
    format.fmt.pix_mp.height = static_cast<std::uint32_t>(size.height);
    format.fmt.pix_mp.pixelformat = code;
    format.fmt.pix_mp.field = field;
  } else {
    format.fmt.pix.width = static_cast<std::uint32_t>(size.width);
    format.fmt.pix.height = static_cast<std::uint32_t>(size.height);
    format.fmt.pix.pixelformat = code;
    format.fmt.pix.field = field;
  }
  return format;
}

struct FormatView {
  std::uint32_t code, field, stride, bytes;
  int width, height, planes;
};

FormatView read(const v4l2_format& format) {
  if (format.type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE) {
    const v4l2_pix_format_mplane& pix = format.fmt.pix_mp;
    return {pix.pixelformat,
            pix.field,
            pix.plane_fmt[0].bytesperline,
            pix.plane_fmt[0].sizeimage,
            static_cast<int>(pix.width),
            static_cast<int>(pix.height),
            pix.num_planes};
  }
  const v4l2_pix_format& pix = format.fmt.pix;
  return {pix.pixelformat,
          pix.field,
          pix.bytesperline,
          pix.sizeimage,
          static_cast<int>(pix.width),
          static_cast<int>(pix.height),
          1};
}

cv::Size buffer_size(cv::Size frame, std::uint32_t field) {
  return V4L2_FIELD_HAS_T_OR_B(field) ? cv::Size(frame.width, frame.height / 2) : frame;
}

cv::Size current_size(const VideoDevice& device) {
  v4l2_format format{};
  format.type = device.buffer_type();
  device.require(VIDIOC_G_FMT, format, "ask for the size");
  const FormatView now = read(format);
  return V4L2_FIELD_HAS_T_OR_B(now.field) ? cv::Size(now.width, 2 * now.height)
                                          : cv::Size(now.width, now.height);
}

cv::Size wanted_size(const VideoDevice& device, const V4l2Options& options,
                     const Agreement& agreed) {
  if (options.width > 0) return {options.width, options.height};
  if (agreed.signal.standard != 0)
    return (agreed.signal.standard & V4L2_STD_525_60) != 0 ? cv::Size(720, 480)
                                                           : cv::Size(720, 576);
  return choose_size(device, agreed.format->fourcc, current_size(device));
}

void require_field(const VideoDevice& device, std::uint32_t wanted, std::uint32_t got) {
  if (wanted == got) return;
  device.fail(ErrorKind::kUnsupported,
              fmt::format("field={} - the driver makes it {}; leave field= out to take what it has",
                          field_to_string(wanted), field_to_string(got)));
}

// Cropping and scaling survive the program that set them; where the driver has them, undo them.
void use_whole_sensor(const VideoDevice& device) {
  v4l2_selection whole{};
  whole.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  whole.target = V4L2_SEL_TGT_CROP_DEFAULT;
  if (device.attempt(VIDIOC_G_SELECTION, whole) != 0) return;
  whole.target = V4L2_SEL_TGT_CROP;
  device.attempt(VIDIOC_S_SELECTION, whole);
}

void fill_whole_image(const VideoDevice& device, const v4l2_format& format) {
  const FormatView image = read(format);
  v4l2_selection whole{};
  whole.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  whole.target = V4L2_SEL_TGT_COMPOSE;
  whole.r.width = static_cast<std::uint32_t>(image.width);
  whole.r.height = static_cast<std::uint32_t>(image.height);
  device.attempt(VIDIOC_S_SELECTION, whole);
}

// Sets format, size and order of fields as near to what is wanted as the driver goes.
FormatView set_nearest(const VideoDevice& device, std::uint32_t code, cv::Size wanted,
                       std::uint32_t field) {
  use_whole_sensor(device);
  v4l2_format format = make_format(device, code, buffer_size(wanted, field), field);
  device.require(VIDIOC_S_FMT, format, "set the image format");
  // A driver left to choose may give one field alone, which has no dark partner.
  if (field == V4L2_FIELD_ANY && !V4L2_FIELD_HAS_BOTH(read(format).field)) {
    v4l2_format interlaced = make_format(device, code, wanted, V4L2_FIELD_INTERLACED);
    if (device.attempt(VIDIOC_S_FMT, interlaced) == 0) format = interlaced;
  }
  fill_whole_image(device, format);
  return read(format);
}

void require_format(const VideoDevice& device, std::uint32_t wanted, std::uint32_t got) {
  if (wanted == got) return;
  device.fail(ErrorKind::kUnsupported,
              fmt::format("format={} - the driver gives {} here", fourcc_to_string(wanted),
                          fourcc_to_string(got)));
}

void require_whole_pixels(const VideoDevice& device, const Agreement& agreed) {
  if (!agreed.format->has_wide_pixels() || agreed.stride % 2 == 0) return;
  device.fail(ErrorKind::kUnsupported,
              fmt::format("its rows of {} bytes split a 16-bit pixel; try another size= or format=",
                          agreed.stride));
}

void require_size(const VideoDevice& device, cv::Size wanted, cv::Size got) {
  if (wanted == got) return;
  device.fail(ErrorKind::kUnsupported,
              fmt::format("size={}x{} - the nearest that the driver has is {}x{}", wanted.width,
                          wanted.height, got.width, got.height));
}

double choose_rate(const VideoDevice& device, double wanted_hz, v4l2_std_id standard) {
  v4l2_streamparm parameters{};
  parameters.type = device.buffer_type();
  v4l2_fract& period = parameters.parm.capture.timeperframe;
  if (wanted_hz > 0.0) {
    constexpr double kDenominator = 1e6;
    period.numerator = static_cast<std::uint32_t>(kDenominator);
    period.denominator = static_cast<std::uint32_t>(std::llround(wanted_hz * kDenominator));
    if (const int error = device.attempt(VIDIOC_S_PARM, parameters); error != 0)
      device.refuse(fmt::format("set fps={}", wanted_hz), error);
  }
  const bool is_told = device.attempt(VIDIOC_G_PARM, parameters) == 0 && period.numerator > 0 &&
                       period.denominator > 0;
  const double rate_hz = is_told ? static_cast<double>(period.denominator) / period.numerator : 0.0;
  if (wanted_hz > 0.0 && is_told && std::abs(rate_hz - wanted_hz) > 0.05 * wanted_hz) {
    device.fail(ErrorKind::kUnsupported,
                fmt::format("fps={} - the nearest that the driver has at this size is {:.4g}",
                            wanted_hz, rate_hz));
  }
  if ((standard & V4L2_STD_525_60) != 0) return 30000.0 / 1001.0;
  if ((standard & V4L2_STD_625_50) != 0) return 25.0;
  return rate_hz;
}

}  // namespace

void choose_frame_format(const VideoDevice& device, const V4l2Options& options, Agreement& agreed) {
  agreed.format = &choose_format(device, options.format);
  const std::uint32_t code = agreed.format->fourcc;
  const cv::Size wanted = wanted_size(device, options, agreed);
  std::uint32_t field = V4L2_FIELD_ANY;
  if (!options.field.empty()) {
    field = field_from_string(options.field);
  } else if (agreed.signal.standard == 0) {
    field = V4L2_FIELD_NONE;
  }

  const FormatView got = set_nearest(device, code, wanted, field);
  require_format(device, code, got.code);
  if (!options.field.empty()) require_field(device, field, got.field);
  agreed.field = got.field;
  if (got.field == V4L2_FIELD_ANY) agreed.field = V4L2_FIELD_NONE;
  agreed.width = got.width;
  agreed.buffer_height = got.height;
  agreed.stride = std::max<std::size_t>(got.stride, agreed.format->row_bytes(got.width));
  agreed.planes = got.planes;
  require_whole_pixels(device, agreed);
  if (options.width > 0) require_size(device, wanted, agreed.frame_size());
  agreed.picture_rate_hz = choose_rate(device, options.fps, agreed.signal.standard);
}

void set_format(const VideoDevice& device, const Agreement& agreement) {
  const cv::Size size(agreement.width, agreement.buffer_height);
  v4l2_format format = make_format(device, agreement.format->fourcc, size, agreement.field);
  device.require(VIDIOC_S_FMT, format, "set the image format");
  const FormatView got = read(format);
  if (got.code != agreement.format->fourcc || got.width != agreement.width ||
      got.height != agreement.buffer_height || got.field != agreement.field) {
    device.fail(ErrorKind::kDevice,
                fmt::format("it no longer gives {}: another program changed its input or standard; "
                            "open it again",
                            agreement.describe()));
  }
}

}  // namespace striper::detail::v4l2
