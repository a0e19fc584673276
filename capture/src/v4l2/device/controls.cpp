// SPDX-License-Identifier: Apache-2.0
#include "v4l2/device/controls.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/core/event.hpp>

namespace striper::detail::v4l2 {
namespace {

// v4l2-ctl's rule: letters and digits in lower case, everything between them one underscore.
std::string plain_name(const std::string& name) {
  std::string plain;
  for (const char letter : name) {
    const auto byte = static_cast<unsigned char>(letter);
    if (std::isalnum(byte) != 0) {
      plain += static_cast<char>(std::tolower(byte));
    } else if (!plain.empty() && plain.back() != '_') {
      plain += '_';
    }
  }
  while (plain.ends_with('_')) plain.pop_back();
  return plain;
}

bool is_menu(std::uint32_t type) {
  return type == V4L2_CTRL_TYPE_MENU || type == V4L2_CTRL_TYPE_INTEGER_MENU;
}

std::vector<MenuEntry> list_menu(const VideoDevice& device, const v4l2_query_ext_ctrl& query) {
  std::vector<MenuEntry> menu;
  for (std::int64_t index = query.minimum; index <= query.maximum; ++index) {
    v4l2_querymenu entry{};
    entry.id = query.id;
    entry.index = static_cast<std::uint32_t>(index);
    if (device.attempt(VIDIOC_QUERYMENU, entry) != 0) continue;  // Menus may have holes.
    const bool is_number = query.type == V4L2_CTRL_TYPE_INTEGER_MENU;
    const std::int64_t number = entry.value;
    menu.push_back({index, is_number ? std::to_string(number) : text_of(entry.name)});
  }
  return menu;
}

int write_control(const VideoDevice& device, const Control& control, std::int64_t value) {
  v4l2_ext_control one{};
  one.id = control.id;
  if (control.type == V4L2_CTRL_TYPE_INTEGER64) {
    one.value64 = value;
  } else {
    one.value = static_cast<std::int32_t>(value);
  }
  v4l2_ext_controls all{};
  all.which = V4L2_CTRL_WHICH_CUR_VAL;
  all.count = 1;
  all.controls = &one;
  return device.attempt(VIDIOC_S_EXT_CTRLS, all);
}

const Control* find(const std::vector<Control>& controls, const std::string& name) {
  // The kernel renamed these in 2021; both names stay usable.
  static const std::map<std::string, std::uint32_t> kOtherNames{
      {"exposure_absolute", V4L2_CID_EXPOSURE_ABSOLUTE},
      {"exposure_time_absolute", V4L2_CID_EXPOSURE_ABSOLUTE},
      {"exposure_auto", V4L2_CID_EXPOSURE_AUTO},
      {"auto_exposure", V4L2_CID_EXPOSURE_AUTO},
      {"gain", V4L2_CID_GAIN},
      {"analogue_gain", V4L2_CID_ANALOGUE_GAIN},
  };
  const auto other = kOtherNames.find(name);
  const std::uint32_t id = other == kOtherNames.end() ? 0 : other->second;
  const auto found = std::find_if(controls.begin(), controls.end(), [&](const Control& control) {
    return control.name == name || (id != 0 && control.id == id);
  });
  return found == controls.end() ? nullptr : &*found;
}

const Control* find(const std::vector<Control>& controls, std::uint32_t id) {
  const auto found = std::find_if(controls.begin(), controls.end(),
                                  [&](const Control& control) { return control.id == id; });
  return found == controls.end() ? nullptr : &*found;
}

std::string bounds_of(const Control& control) {
  if (!is_menu(control.type))
    return fmt::format("a whole number from {} to {} in steps of {}", control.minimum,
                       control.maximum, control.step);
  std::vector<std::string> entries;
  entries.reserve(control.menu.size());
  for (const MenuEntry& entry : control.menu)
    entries.push_back(fmt::format("{} ({})", entry.index, entry.text));
  return fmt::format("one of {}", fmt::join(entries, ", "));
}

std::int64_t parse_value(const VideoDevice& device, const Control& control,
                         const std::string& text) {
  for (const MenuEntry& entry : control.menu) {
    if (plain_name(entry.text) == plain_name(text) && !plain_name(text).empty() &&
        control.type == V4L2_CTRL_TYPE_MENU) {
      return entry.index;
    }
  }
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_number = error == std::errc() && end == text.data() + text.size();
  bool fits = is_number && value >= control.minimum && value <= control.maximum;
  if (fits && is_menu(control.type)) {
    fits = std::any_of(control.menu.begin(), control.menu.end(),
                       [&](const MenuEntry& entry) { return entry.index == value; });
  }
  if (!fits) {
    device.fail(ErrorKind::kUsage,
                fmt::format("{}={} - expected {}", control.name, text, bounds_of(control)));
  }
  return value;
}

void require_write(const VideoDevice& device, const Control& control, std::int64_t value) {
  if ((control.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0)
    device.fail(ErrorKind::kUsage, fmt::format("the control {} can only be read", control.name));
  if (const int error = write_control(device, control, value); error != 0)
    device.refuse(fmt::format("set {}={}", control.name, value), error);
}

bool is_automatic_mode(const Control& control) {
  return control.name.find("auto") != std::string::npos;
}

}  // namespace

std::vector<Control> list_controls(const VideoDevice& device) {
  constexpr std::uint32_t kNext = V4L2_CTRL_FLAG_NEXT_CTRL;
  std::vector<Control> controls;
  v4l2_query_ext_ctrl query{};
  query.id = kNext;
  while (device.attempt(VIDIOC_QUERY_EXT_CTRL, query) == 0) {
    const bool is_usable = (query.flags & V4L2_CTRL_FLAG_DISABLED) == 0 &&
                           (query.flags & V4L2_CTRL_FLAG_HAS_PAYLOAD) == 0 &&
                           query.type != V4L2_CTRL_TYPE_CTRL_CLASS &&
                           query.type != V4L2_CTRL_TYPE_STRING;
    if (is_usable) {
      Control control{query.id,
                      plain_name(text_of(query.name)),
                      query.type,
                      query.flags,
                      query.minimum,
                      query.maximum,
                      query.step,
                      query.default_value,
                      {}};
      if (is_menu(query.type)) control.menu = list_menu(device, query);
      controls.push_back(std::move(control));
    }
    const std::uint32_t id = query.id;
    query = {};
    query.id = id | kNext;
  }
  return controls;
}

int read_control(const VideoDevice& device, const Control& control, std::int64_t& value) {
  v4l2_ext_control one{};
  one.id = control.id;
  v4l2_ext_controls all{};
  all.which = V4L2_CTRL_WHICH_CUR_VAL;
  all.count = 1;
  all.controls = &one;
  const int error = device.attempt(VIDIOC_G_EXT_CTRLS, all);
  value = control.type == V4L2_CTRL_TYPE_INTEGER64 ? static_cast<std::int64_t>(one.value64)
                                                   : static_cast<std::int64_t>(one.value);
  return error;
}

void set_controls(const VideoDevice& device, const std::map<std::string, std::string>& wanted) {
  if (wanted.empty()) return;
  const std::vector<Control> controls = list_controls(device);
  std::vector<std::pair<const Control*, std::int64_t>> settings;
  for (const auto& [name, text] : wanted) {
    const Control* const control = find(controls, name);
    if (control == nullptr) {
      std::vector<std::string> names;
      names.reserve(controls.size());
      for (const Control& known : controls) names.push_back(known.name);
      device.fail(
          ErrorKind::kUsage,
          fmt::format("'{}' is neither a key of v4l2: (input, standard, format, field, size, "
                      "fps, exposure_us, buffers, queue, reconnect, stall_s, signal, "
                      "time_offset_us, laser, fields) nor a control of '{}', which has {}",
                      name, device.card(), fmt::join(names, ", ")));
    }
    settings.emplace_back(control, parse_value(device, *control, text));
  }
  std::stable_partition(settings.begin(), settings.end(),
                        [](const auto& setting) { return is_automatic_mode(*setting.first); });
  for (const auto& [control, value] : settings) require_write(device, *control, value);
}

std::int64_t set_exposure(const VideoDevice& device, double exposure_us, const EventPort& events) {
  const std::vector<Control> controls = list_controls(device);
  const Control* const exposure = find(controls, V4L2_CID_EXPOSURE_ABSOLUTE);
  if (exposure == nullptr) {
    device.fail(ErrorKind::kUnsupported,
                fmt::format("exposure_us={}: '{}' has no control for an exposure in time; set the "
                            "shutter on the camera itself",
                            exposure_us, device.card()));
  }
  if (const Control* const mode = find(controls, V4L2_CID_EXPOSURE_AUTO))
    require_write(device, *mode, V4L2_EXPOSURE_MANUAL);
  const auto units = static_cast<std::int64_t>(std::llround(exposure_us / kExposureUnitUs));
  if (units < exposure->minimum || units > exposure->maximum) {
    device.fail(
        ErrorKind::kUnsupported,
        fmt::format("exposure_us={}: the camera takes {:.0f} to {:.0f}, in steps of {:.0f}",
                    exposure_us, static_cast<double>(exposure->minimum) * kExposureUnitUs,
                    static_cast<double>(exposure->maximum) * kExposureUnitUs, kExposureUnitUs));
  }
  require_write(device, *exposure, units);
  const std::int64_t exposure_ns = read_exposure_ns(device);
  constexpr double kAsAskedFor = 0.1;
  const double is_us = 1e-3 * static_cast<double>(exposure_ns);
  if (std::abs(is_us - exposure_us) > kAsAskedFor * exposure_us) {
    events.send({"setting_adjusted",
                 fmt::format("v4l2 '{}': exposure_us={} became {:.0f}, the nearest that the camera "
                             "takes",
                             device.card(), exposure_us, is_us)});
  }
  return exposure_ns;
}

std::int64_t read_exposure_ns(const VideoDevice& device) {
  const auto read = [&](std::uint32_t id, std::int64_t& value) {
    Control control;
    control.id = id;
    return read_control(device, control, value) == 0;
  };
  std::int64_t mode = V4L2_EXPOSURE_MANUAL;
  const bool has_mode = read(V4L2_CID_EXPOSURE_AUTO, mode);
  const bool is_fixed =
      !has_mode || mode == V4L2_EXPOSURE_MANUAL || mode == V4L2_EXPOSURE_SHUTTER_PRIORITY;
  std::int64_t units = 0;
  if (!is_fixed || !read(V4L2_CID_EXPOSURE_ABSOLUTE, units)) return 0;
  return static_cast<std::int64_t>(static_cast<double>(units) * kExposureUnitUs * 1000.0);
}

}  // namespace striper::detail::v4l2
