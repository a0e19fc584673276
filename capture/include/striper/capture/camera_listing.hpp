// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace striper {

/// An input of a grabber; a camera without inputs has none.
struct CameraInput {
  int index = 0;
  std::string name;
  std::vector<std::string> standards;  ///< `ntsc-m`, `pal-bg`, ...; empty: no television input.
  std::string trouble;                 ///< What is wrong with its signal now; empty: nothing.
  bool is_current = false;
};

/// An image size and how fast such frames can come.
struct CameraSize {
  int width = 0;
  int height = 0;
  std::vector<double> rates_hz;  ///< Empty where the driver does not say.
};

/// A pixel format.
struct CameraFormat {
  std::string name;               ///< As `format=` takes it: `GREY`, `YUYV`, `Mono8`.
  std::string description;        ///< For people.
  bool is_usable = false;         ///< striper knows it.
  std::vector<CameraSize> sizes;  ///< Empty where any size in some range goes, see `size_range`.
  std::string size_range;         ///< "16x16 to 1920x1080 in steps of 2x2"; empty for a list.
};

/// A control that can be set in a source's address by its name.
struct CameraControl {
  std::string name;
  std::string type;  ///< `integer`, `boolean`, `menu`, `button`, ...
  double minimum = 0.0;
  double maximum = 0.0;
  double step = 0.0;
  double default_value = 0.0;
  std::optional<double> value;    ///< Empty where it cannot be read.
  std::vector<std::string> menu;  ///< "1: Manual Mode", ...
  bool is_settable = true;
};

/// A camera that striper can open, with all that can be asked of it.
struct CameraListing {
  std::string uri;                      ///< What opens it: `v4l2:/dev/video0`.
  std::string kind;                     ///< `v4l2`, `gige`, `u3v`.
  std::string name;                     ///< Make and model.
  std::string serial;                   ///< Empty where it has none, or does not tell.
  std::string driver;                   ///< Of the system, or the camera's firmware.
  std::string address;                  ///< Where it is connected: bus, network address.
  std::vector<std::string> other_uris;  ///< Names that survive replugging and restarting.
  std::string access;   ///< `free`, `held by 10.0.0.5:4711`, `other subnet`; empty: not told.
  std::string trouble;  ///< Why it cannot be opened now; empty: it can.
  std::vector<CameraInput> inputs;
  std::vector<CameraFormat> formats;
  std::vector<CameraControl> controls;
};

}  // namespace striper
