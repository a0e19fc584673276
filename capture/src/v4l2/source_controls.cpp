// SPDX-License-Identifier: Apache-2.0
#include "v4l2/source_controls.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "v4l2/device/controls.hpp"

namespace striper::detail::v4l2 {
namespace {

struct Device {
  std::shared_ptr<VideoCalls> calls;
  std::string path;
  std::function<void(std::int64_t)> on_exposure;

  VideoDevice open() const { return VideoDevice(calls, path); }
};

// A button has no value, and a bit mask is no number.
bool is_usable(const Control& control) {
  return control.type != V4L2_CTRL_TYPE_BUTTON && control.type != V4L2_CTRL_TYPE_BITMASK;
}

// The control as it is now; empty where the device does not have it. Its bounds and whether it can
// be written may depend on others.
ControlState state_of(const VideoDevice& device, std::uint32_t id, double unit) {
  const std::vector<Control> controls = list_controls(device);
  const auto found = std::find_if(controls.begin(), controls.end(),
                                  [&](const Control& control) { return control.id == id; });
  std::int64_t value = 0;
  if (found == controls.end() || read_control(device, *found, value) != 0) return {};
  const auto scaled = [&](std::int64_t number) {
    return ControlValue{unit * static_cast<double>(number)};
  };
  const bool is_writable = (found->flags & V4L2_CTRL_FLAG_READ_ONLY) == 0;
  return {scaled(value), scaled(found->minimum), scaled(found->maximum), is_writable};
}

ControlRow exposure_row(const Device& device) {
  return {"exposure_us", ControlType::kNumber, "us",
          [device] { return state_of(device.open(), V4L2_CID_EXPOSURE_ABSOLUTE, kExposureUnitUs); },
          [device](const ControlValue& value) {
            device.on_exposure(set_exposure(device.open(), value[0], {}));
          }};
}

ControlRow region_row(cv::Size image) {
  const ControlValue all{0.0, 0.0, static_cast<double>(image.width),
                         static_cast<double>(image.height)};
  return {"region", ControlType::kRegion, "px",
          [all] {
            return ControlState{all, all, all};
          },
          nullptr};
}

// One of the device's own.
ControlRow own_row(const Device& device, const Control& control) {
  const bool is_switch = control.type == V4L2_CTRL_TYPE_BOOLEAN;
  return {control.name, is_switch ? ControlType::kSwitch : ControlType::kNumber, "",
          [device, id = control.id] { return state_of(device.open(), id, 1.0); },
          [device, name = control.name](const ControlValue& value) {
            const VideoDevice opened = device.open();
            set_controls(opened, {{name, std::to_string(std::llround(value[0]))}});
            device.on_exposure(read_exposure_ns(opened));
          }};
}

}  // namespace

Controls make_controls(const VideoDevice& opened, cv::Size image,
                       std::function<void(std::int64_t)> on_exposure) {
  const Device device{opened.calls(), opened.path(), std::move(on_exposure)};
  std::vector<ControlRow> rows{exposure_row(device), region_row(image)};
  for (const Control& control : list_controls(opened)) {
    if (is_usable(control)) rows.push_back(own_row(device, control));
  }
  return {"v4l2:" + opened.path(), std::move(rows)};
}

}  // namespace striper::detail::v4l2
