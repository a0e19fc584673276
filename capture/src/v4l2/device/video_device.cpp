// SPDX-License-Identifier: Apache-2.0
#include "v4l2/device/video_device.hpp"

#include <cerrno>
#include <cstring>
#include <utility>

#include <fmt/format.h>

namespace striper::detail::v4l2 {
namespace {

constexpr const char* kListHint = "`striper devices` lists those that there are";

ErrorKind kind_of(int error) { return error == ENOENT ? ErrorKind::kNotFound : ErrorKind::kDevice; }

std::string describe_node(std::uint32_t capabilities) {
  if ((capabilities & (V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_VIDEO_OUTPUT_MPLANE)) != 0)
    return "a video output";
  if ((capabilities & (V4L2_CAP_VIDEO_M2M | V4L2_CAP_VIDEO_M2M_MPLANE)) != 0)
    return "a converter or codec";
  if ((capabilities & V4L2_CAP_META_CAPTURE) != 0) return "a camera's node for metadata";
  if ((capabilities & (V4L2_CAP_VBI_CAPTURE | V4L2_CAP_SLICED_VBI_CAPTURE)) != 0)
    return "a teletext (VBI) node";
  if ((capabilities & V4L2_CAP_TUNER) != 0) return "a radio or tuner";
  return "no camera";
}

}  // namespace

std::string advice(int error) {
  switch (error) {
    case ENOENT:
      return fmt::format("there is no such device; {}", kListHint);
    case ENODEV:
    case ENXIO:
      return fmt::format(
          "the device behind it is gone: plug it in again, or look whether it got "
          "another number; {}",
          kListHint);
    case EACCES:
    case EPERM:
      return "no permission: add yourself to the group that owns it (usually `sudo usermod -aG "
             "video "
             "$USER`) and log in again";
    case EBUSY:
      return "it is busy: another program streams from it (`fuser -v` with its name shows which); "
             "close that one first";
    case ENOTTY:
      return "it is not a Video4Linux device, or its driver has no such call";
    case ENOLINK:
      return "there is no signal: look at the cable and whether the camera is on";
    case ENOLCK:
      return "the signal is not locked: look at the cable and whether standard= fits the camera";
    case ENOMEM:
      return "the driver has no memory for it: ask for a smaller size or fewer buffers";
    case ENOSPC:
      return "no bus bandwidth left: use another USB port, a smaller size or lower fps";
    default:
      return fmt::format("{} (error {})", std::strerror(error), error);
  }
}

VideoDevice::VideoDevice(std::shared_ptr<VideoCalls> calls, std::string path)
    : calls_(std::move(calls)), path_(std::move(path)), fd_(calls_->open(path_)) {
  if (fd_ < 0) refuse("open it", -fd_);
  try {
    identify();
  } catch (...) {
    calls_->close(fd_);
    throw;
  }
}

VideoDevice::~VideoDevice() { calls_->close(fd_); }

std::uint32_t VideoDevice::buffer_type() const noexcept {
  return is_multiplanar_ ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
}

void VideoDevice::identify() {
  v4l2_capability capability{};
  require(VIDIOC_QUERYCAP, capability, "ask what it is");
  card_ = text_of(capability.card);
  driver_ = text_of(capability.driver);
  bus_ = text_of(capability.bus_info);
  const std::uint32_t all = capability.capabilities;
  const std::uint32_t node = (all & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : all;

  is_multiplanar_ = (node & V4L2_CAP_VIDEO_CAPTURE) == 0;
  if ((node & (V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE)) == 0) {
    fail(ErrorKind::kDevice, fmt::format("this node of '{}' is {}, it does not capture frames; {}",
                                         card_, describe_node(node), kListHint));
  }
  if ((node & V4L2_CAP_STREAMING) == 0) {
    fail(ErrorKind::kUnsupported,
         fmt::format("the driver '{}' of '{}' cannot stream into mapped memory", driver_, card_));
  }
}

void VideoDevice::refuse(const std::string& what, int error) const {
  fail(kind_of(error), fmt::format("cannot {}: {}", what, advice(error)));
}

void VideoDevice::fail(ErrorKind kind, const std::string& message) const {
  throw Error(kind, fmt::format("v4l2 {}: {}", path_, message));
}
}  // namespace striper::detail::v4l2
