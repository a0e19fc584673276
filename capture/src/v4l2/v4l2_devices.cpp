// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/v4l2/v4l2_devices.hpp>

#include "v4l2/device/controls.hpp"
#include "v4l2/device/names.hpp"
#include "v4l2/device/signal.hpp"
#include "v4l2/device/video_device.hpp"
#include "v4l2/format/picture_lists.hpp"
#include "v4l2/format/pixel_format.hpp"
#include "v4l2/v4l2_stream.hpp"

namespace striper::detail::v4l2 {
namespace {

namespace fs = std::filesystem;

void describe_sizes(const VideoDevice& device, std::uint32_t code, CameraFormat& format) {
  for (const v4l2_frmsizeenum& size : list_sizes(device, code)) {
    if (size.type != V4L2_FRMSIZE_TYPE_DISCRETE) {
      const v4l2_frmsize_stepwise& range = size.stepwise;
      format.size_range =
          fmt::format("{}x{} to {}x{} in steps of {}x{}", range.min_width, range.min_height,
                      range.max_width, range.max_height, range.step_width, range.step_height);
      return;
    }
    format.sizes.push_back({static_cast<int>(size.discrete.width),
                            static_cast<int>(size.discrete.height),
                            list_rates(device, code, size.discrete).listed_hz});
  }
}

std::vector<CameraFormat> describe_formats(const VideoDevice& device) {
  std::vector<CameraFormat> formats;
  for (const v4l2_fmtdesc& description : list_formats(device)) {
    CameraFormat& format = formats.emplace_back();
    format.name = fourcc_to_string(description.pixelformat);
    format.description = text_of(description.description);
    format.is_usable = find_pixel_format(description.pixelformat) != nullptr;
    describe_sizes(device, description.pixelformat, format);
  }
  return formats;
}

std::vector<CameraInput> describe_inputs(const VideoDevice& device) {
  int current = -1;
  if (device.attempt(VIDIOC_G_INPUT, current) != 0) current = -1;
  std::vector<CameraInput> inputs;
  for (const v4l2_input& input : list_inputs(device)) {
    inputs.push_back({static_cast<int>(input.index), text_of(input.name),
                      standards_to_strings(input.std), signal_trouble(input.status),
                      static_cast<int>(input.index) == current});
  }
  return inputs;
}

std::string type_name(std::uint32_t type) {
  switch (type) {
    case V4L2_CTRL_TYPE_INTEGER:
      return "integer";
    case V4L2_CTRL_TYPE_BOOLEAN:
      return "boolean";
    case V4L2_CTRL_TYPE_MENU:
      return "menu";
    case V4L2_CTRL_TYPE_BUTTON:
      return "button";
    case V4L2_CTRL_TYPE_INTEGER64:
      return "integer64";
    case V4L2_CTRL_TYPE_BITMASK:
      return "bitmask";
    case V4L2_CTRL_TYPE_INTEGER_MENU:
      return "integer menu";
    default:
      return "other";
  }
}

std::vector<CameraControl> describe_controls(const VideoDevice& device) {
  std::vector<CameraControl> described;
  for (const Control& control : list_controls(device)) {
    CameraControl one;
    one.name = control.name;
    one.type = type_name(control.type);
    one.minimum = static_cast<double>(control.minimum);
    one.maximum = static_cast<double>(control.maximum);
    one.step = static_cast<double>(control.step);
    one.default_value = static_cast<double>(control.default_value);
    one.is_settable = (control.flags & V4L2_CTRL_FLAG_READ_ONLY) == 0;
    std::int64_t value = 0;
    const bool is_readable = (control.flags & V4L2_CTRL_FLAG_WRITE_ONLY) == 0;
    if (is_readable && read_control(device, control, value) == 0)
      one.value = static_cast<double>(value);
    for (const MenuEntry& entry : control.menu)
      one.menu.push_back(fmt::format("{}: {}", entry.index, entry.text));
    described.push_back(std::move(one));
  }
  return described;
}

// Links of udev's that name the same node and stay the same when it is plugged in again.
std::vector<std::string> lasting_names(const std::string& path) {
  std::vector<std::string> uris;
  std::error_code error;
  for (const char* const folder : {"/dev/v4l/by-id", "/dev/v4l/by-path"}) {
    for (const auto& link : fs::directory_iterator(folder, error)) {
      if (fs::equivalent(link.path(), path, error)) uris.push_back("v4l2:" + link.path().string());
    }
  }
  std::sort(uris.begin(), uris.end());
  return uris;
}

int number_of(const std::string& path) {
  const std::size_t digits = path.find_last_not_of("0123456789") + 1;
  int number = 0;
  std::from_chars(path.data() + digits, path.data() + path.size(), number);
  return number;
}

std::vector<std::string> list_nodes() {
  std::vector<std::string> nodes;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/dev", error)) {
    const std::string path = entry.path().string();
    if (path.starts_with("/dev/video")) nodes.push_back(path);
  }
  std::sort(nodes.begin(), nodes.end(),
            [](const std::string& a, const std::string& b) { return number_of(a) < number_of(b); });
  return nodes;
}

}  // namespace

CameraListing describe(const std::string& path, std::shared_ptr<VideoCalls> calls) {
  const VideoDevice device(std::move(calls), path);
  CameraListing listing;
  listing.uri = "v4l2:" + path;
  listing.kind = "v4l2";
  listing.name = device.card();
  listing.driver = device.driver();
  listing.address = device.bus();
  listing.other_uris = lasting_names(path);
  listing.inputs = describe_inputs(device);
  listing.formats = describe_formats(device);
  listing.controls = describe_controls(device);
  return listing;
}

}  // namespace striper::detail::v4l2

namespace striper {

CameraListing describe_v4l2_camera(const std::string& path) {
  return detail::v4l2::describe(path, detail::v4l2::system_video_calls());
}

std::vector<CameraListing> list_v4l2_cameras() {
  const auto calls = detail::v4l2::system_video_calls();
  std::vector<CameraListing> listings;
  for (const std::string& node : detail::v4l2::list_nodes()) {
    const int fd = calls->open(node);
    if (fd == -EACCES || fd == -EPERM) {
      CameraListing listing;
      listing.uri = "v4l2:" + node;
      listing.kind = "v4l2";
      listing.name = "unknown";
      listing.trouble = detail::v4l2::advice(-fd);
      listings.push_back(std::move(listing));
    }
    if (fd < 0) continue;
    calls->close(fd);
    try {
      listings.push_back(detail::v4l2::describe(node, calls));
    } catch (const Error&) {
      continue;  // Outputs, codecs, metadata: nothing that can be opened as a camera.
    }
  }
  return listings;
}

}  // namespace striper
