// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include <striper/core/error.hpp>
#include <striper/stream/messages/compressed_image.hpp>
#include <striper/stream/messages/scan_messages.hpp>

namespace striper {
namespace {

// "mono8; jpeg compressed mono8": what was there, and what it became (compressed_image_transport).
std::string_view format_of(int type) {
  switch (type) {
    case CV_8UC1:
      return "mono8; jpeg compressed mono8";
    case CV_8UC3:
      return "bgr8; jpeg compressed bgr8";
    case CV_16UC1:
      return "mono16; png compressed mono16";
    case CV_16UC3:
      return "bgr16; png compressed bgr16";
    default:
      break;
  }
  throw Error(ErrorKind::kUnsupported,
              fmt::format("an image of OpenCV's type {} cannot be compressed for ROS 2", type));
}

}  // namespace

void to_message(const Frame& frame, std::string_view frame_id, wire::CompressedImage& message) {
  const bool is_lossy = frame.image.depth() == CV_8U;
  message.header.stamp = to_stamp(frame.time);
  message.header.frame_id = frame_id;
  message.format = format_of(frame.image.type());
  cv::imencode(is_lossy ? ".jpg" : ".png", frame.image, message.data);
}

}  // namespace striper
