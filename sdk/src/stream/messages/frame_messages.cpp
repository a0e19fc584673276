// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include <striper/core/error.hpp>
#include <striper/stream/messages/frame_messages.hpp>
#include <striper/stream/messages/scan_messages.hpp>

namespace striper {
namespace {

struct Encoding {
  std::string_view name;
  int type;
  bool is_rgb;
};
// Ours first: of each type the one that is written.
constexpr std::array<Encoding, 6> kEncodings = {{{"mono8", CV_8UC1, false},
                                                 {"mono16", CV_16UC1, false},
                                                 {"bgr8", CV_8UC3, false},
                                                 {"bgr16", CV_16UC3, false},
                                                 {"rgb8", CV_8UC3, true},
                                                 {"rgb16", CV_16UC3, true}}};

[[noreturn]] void refuse(std::string_view what, ErrorKind kind = ErrorKind::kBadFile) {
  throw Error(kind, std::string(what));
}

template <typename T>
void require_between(std::string_view field, T value, T least, T greatest) {
  if (value >= least && value <= greatest) return;
  refuse(fmt::format("striper_msgs/msg/FrameInfo.{}: {} where {} to {} is expected", field, value,
                     least, greatest));
}

int illumination_code(const Illumination& illumination) {
  if (illumination.is_unknown()) return -2;
  return illumination.is_dark() ? -1 : illumination.laser_index();
}

Illumination illumination_of(int code) {
  if (code == -2) return Illumination::unknown();
  return code == -1 ? Illumination::dark() : Illumination::laser(code);
}

void require_frame(const wire::FrameInfo& m) {
  require_between<int>("exposures_per_picture", m.exposures_per_picture, 1, 2);
  require_between<int>("exposure_in_picture", m.exposure_in_picture, 0,
                       m.exposures_per_picture - 1);
  require_between("illumination", m.illumination, -2, 255);
  require_between<int>("field", m.field, 0, static_cast<int>(Field::kInterlacedBottomFirst));
  require_between<int>("bit_depth", m.bit_depth, 8, 16);
  require_between<std::uint32_t>("sensor_width", m.sensor_width, 0, 1 << 16);
  require_between<std::uint32_t>("sensor_height", m.sensor_height, 0, 1 << 16);
  require_between<int>("status", m.status, 0, static_cast<int>(FrameStatus::kWrongSize));
}

IlluminationPattern pattern_of(const std::string& text) {
  try {
    return text.empty() ? IlluminationPattern() : IlluminationPattern::parse(text);
  } catch (const Error& error) {
    refuse(fmt::format("striper_msgs/msg/FrameInfo.cadence: {}", error.what()));
  }
}

void swap_bytes(cv::Mat& image) {
  for (int row = 0; row < image.rows; ++row) {
    auto* values = image.ptr<std::uint16_t>(row);
    for (int i = 0; i < image.cols * image.channels(); ++i) {
      values[i] = static_cast<std::uint16_t>(values[i] << 8 | values[i] >> 8);
    }
  }
}

void swap_red_and_blue(cv::Mat& image) {
  cv::Mat swapped(image.size(), image.type());
  const int from_to[] = {0, 2, 1, 1, 2, 0};
  cv::mixChannels(&image, 1, &swapped, 1, from_to, 3);
  image = swapped;
}

}  // namespace

void to_message(const Frame& frame, const IlluminationPattern& pattern, wire::FrameInfo& message) {
  message.sequence = frame.sequence;
  message.exposure_in_picture = static_cast<std::uint8_t>(frame.exposure_in_picture);
  message.exposures_per_picture = static_cast<std::uint8_t>(frame.exposures_per_picture);
  message.monotonic_ns = frame.time.monotonic_ns;
  message.has_utc = frame.time.utc_offset_ns.has_value();
  message.utc_offset_ns = frame.time.utc_offset_ns.value_or(0);
  message.field_period_ns = frame.field_period_ns;
  message.exposure_ns = frame.exposure_ns;
  message.illumination = illumination_code(frame.illumination);
  message.field = static_cast<std::uint8_t>(frame.field);
  message.bit_depth = static_cast<std::uint8_t>(frame.bit_depth);
  message.sensor_width = static_cast<std::uint32_t>(frame.sensor_size.width);
  message.sensor_height = static_cast<std::uint32_t>(frame.sensor_size.height);
  message.grid_u_offset = frame.grid.u.offset;
  message.grid_u_step = frame.grid.u.step;
  message.grid_v_offset = frame.grid.v.offset;
  message.grid_v_step = frame.grid.v.step;
  message.cadence = pattern.to_string();
  message.epoch = frame.epoch;
  message.status = static_cast<std::uint8_t>(frame.status);
  message.detail = frame.status_detail;
  message.has_encoder = frame.encoder_counts.has_value();
  message.encoder_counts = frame.encoder_counts.value_or(0);
}

void from_message(const wire::FrameInfo& message, Frame& frame, IlluminationPattern& pattern) {
  require_frame(message);
  pattern = pattern_of(message.cadence);
  frame.sequence = message.sequence;
  frame.exposure_in_picture = message.exposure_in_picture;
  frame.exposures_per_picture = message.exposures_per_picture;
  frame.time.monotonic_ns = message.monotonic_ns;
  frame.time.utc_offset_ns.reset();
  if (message.has_utc) frame.time.utc_offset_ns = message.utc_offset_ns;
  frame.field_period_ns = message.field_period_ns;
  frame.exposure_ns = message.exposure_ns;
  frame.illumination = illumination_of(message.illumination);
  frame.field = static_cast<Field>(message.field);
  frame.bit_depth = message.bit_depth;
  frame.sensor_size = {static_cast<int>(message.sensor_width),
                       static_cast<int>(message.sensor_height)};
  frame.grid = {{message.grid_u_offset, message.grid_u_step},
                {message.grid_v_offset, message.grid_v_step}};
  frame.epoch = message.epoch;
  frame.status = static_cast<FrameStatus>(message.status);
  frame.status_detail = message.detail;
  frame.encoder_counts.reset();
  if (message.has_encoder) frame.encoder_counts = message.encoder_counts;
}

void to_message(const Frame& frame, std::string_view frame_id, wire::Image& message) {
  const auto* encoding = std::find_if(kEncodings.begin(), kEncodings.end(), [&](const Encoding& e) {
    return e.type == frame.image.type();
  });
  if (frame.image.empty() || encoding == kEncodings.end()) {
    refuse("a frame without an image of 8 or 16 bits, grey or colour, is no sensor_msgs/msg/Image",
           ErrorKind::kUnsupported);
  }
  message.header.stamp = to_stamp(frame.time);
  message.header.frame_id = frame_id;
  message.height = static_cast<std::uint32_t>(frame.image.rows);
  message.width = static_cast<std::uint32_t>(frame.image.cols);
  message.encoding = encoding->name;
  message.is_bigendian = 0;
  const std::size_t step = static_cast<std::size_t>(frame.image.cols) * frame.image.elemSize();
  message.step = static_cast<std::uint32_t>(step);
  message.data.resize(step * message.height);
  for (int row = 0; row < frame.image.rows; ++row) {
    std::memcpy(message.data.data() + static_cast<std::size_t>(row) * step, frame.image.ptr(row),
                step);
  }
}

void from_message(const wire::Image& message, Frame& frame) {
  const auto* encoding = std::find_if(kEncodings.begin(), kEncodings.end(), [&](const Encoding& e) {
    return e.name == message.encoding;
  });
  if (encoding == kEncodings.end()) {
    refuse(fmt::format("sensor_msgs/msg/Image.encoding: '{}'; mono8, mono16, bgr8, bgr16, rgb8 and "
                       "rgb16 are read",
                       message.encoding),
           ErrorKind::kUnsupported);
  }
  constexpr std::uint32_t kMostPixels = 1 << 16;  // Along one side.
  const std::size_t row_bytes = std::size_t{message.width} * CV_ELEM_SIZE(encoding->type);
  const bool is_size = message.width > 0 && message.height > 0 && message.width <= kMostPixels &&
                       message.height <= kMostPixels;
  if (!is_size || message.step < row_bytes || message.data.size() / message.height < message.step) {
    refuse(fmt::format(
        "sensor_msgs/msg/Image: {} bytes are not {} x {} pixels of {} with {} bytes a row",
        message.data.size(), message.width, message.height, message.encoding, message.step));
  }
  cv::Mat image(static_cast<int>(message.height), static_cast<int>(message.width), encoding->type);
  for (int row = 0; row < image.rows; ++row) {
    std::memcpy(image.ptr(row), message.data.data() + static_cast<std::size_t>(row) * message.step,
                row_bytes);
  }
  if (message.is_bigendian != 0 && image.depth() == CV_16U) swap_bytes(image);
  if (encoding->is_rgb) swap_red_and_blue(image);
  frame.image = image;
}

void to_message(const Event& event, wire::Event& message) {
  const double seconds = std::isfinite(event.time_s) ? std::floor(event.time_s) : 0.0;
  const double fraction = std::isfinite(event.time_s) ? event.time_s - seconds : 0.0;
  message.header.stamp.sec =
      static_cast<std::int32_t>(std::clamp(seconds, -2147483648.0, 2147483647.0));
  message.header.stamp.nanosec =
      static_cast<std::uint32_t>(std::min(std::lround(fraction * 1e9), 999'999'999L));
  message.header.frame_id.clear();
  message.code = event.code.word();
  message.severity = static_cast<std::uint8_t>(event.severity);
  message.head = event.head;
  message.message = event.message;
  message.advice = event.advice;
}

Event event_from_message(const wire::Event& message) {
  const auto code = EventCode::parse(message.code);
  if (!code)
    refuse(
        fmt::format("striper_msgs/msg/Event.code: '{}' is none of this version's", message.code));
  if (message.severity > static_cast<std::uint8_t>(Severity::kRefusal)) {
    refuse(fmt::format("striper_msgs/msg/Event.severity: {} stands for nothing", message.severity));
  }
  Event event(static_cast<Severity>(message.severity), *code, message.message, message.advice);
  event.head = message.head;
  event.time_s = message.header.stamp.sec + message.header.stamp.nanosec / 1e9;
  return event;
}

}  // namespace striper
