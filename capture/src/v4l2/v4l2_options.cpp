// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/v4l2/v4l2_source.hpp>

#include "capture/common_keys.hpp"
#include "v4l2/device/names.hpp"
#include "v4l2/format/pixel_format.hpp"

namespace striper {
namespace {

constexpr int kLargestSide_px = 16384;
constexpr double kLongest_s = 1e6;

[[noreturn]] void refuse(const std::string& uri, const std::string& key, const std::string& value,
                         const std::string& expected) {
  throw Error(ErrorKind::kUsage,
              fmt::format("source '{}': {}={} - expected {}", uri, key, value, expected));
}

void take_size(SourceUri& uri, V4l2Options& options) {
  const auto text = uri.take("size");
  if (!text) return;
  const char* const end = text->data() + text->size();
  const auto [cross, error] = std::from_chars(text->data(), end, options.width);
  const bool has_cross = error == std::errc() && cross != end && *cross == 'x';
  const auto [last, error2] = std::from_chars(has_cross ? cross + 1 : end, end, options.height);
  const auto is_side = [](int side) { return side >= 1 && side <= kLargestSide_px; };
  if (!has_cross || error2 != std::errc() || last != end || !is_side(options.width) ||
      !is_side(options.height)) {
    refuse(uri.text(), "size", *text, "WIDTHxHEIGHT, for example 720x480");
  }
}

void take_reconnect(SourceUri& uri, V4l2Options& options) {
  const auto text = uri.take("reconnect");
  if (!text) return;
  const bool is_number =
      !text->empty() && std::isdigit(static_cast<unsigned char>((*text)[0])) != 0;
  if (is_number) {
    options.reconnect_s = *uri.take_number("reconnect", 0.0, kLongest_s);
  } else if (!*uri.take_bool("reconnect")) {
    options.reconnect_s = 0.0;
  }
}

}  // namespace

V4l2Options V4l2Options::from_uri(SourceUri uri) {
  V4l2Options options;
  options.uri = uri.text();
  options.device = uri.path();
  options.input = uri.take("input").value_or("");
  options.standard = uri.take("standard").value_or("");
  options.format = uri.take("format").value_or("");
  options.field = uri.take("field").value_or("");
  take_size(uri, options);
  options.fps = uri.take_number("fps", 0.01, 10'000).value_or(0.0);
  options.exposure_us = uri.take_number("exposure_us", 1, 1e7).value_or(0.0);
  options.buffers = static_cast<int>(uri.take_integer("buffers", 4, 32).value_or(options.buffers));
  options.queue = static_cast<int>(uri.take_integer("queue", 1, 16).value_or(options.queue));
  take_reconnect(uri, options);
  options.stall_s = uri.take_number("stall_s", 0.1, 3600).value_or(options.stall_s);
  if (const auto word = uri.take("signal")) {
    if (*word != "require" && *word != "ignore")
      refuse(uri.text(), "signal", *word, "require or ignore");
    options.require_signal = *word == "require";
  }
  options.time_offset_us = uri.take_number("time_offset_us", -1e7, 1e7).value_or(0.0);
  const detail::CommonKeys keys = detail::CommonKeys::take(uri);
  options.pattern = keys.pattern;
  options.fields = keys.fields;
  options.controls = uri.take_rest();
  options.validate();
  return options;
}

void V4l2Options::validate() const {
  const std::string name = uri.empty() ? "v4l2:" + device : uri;
  const auto require = [&](bool is_right, const char* key, const std::string& value,
                           const char* expected) {
    if (!is_right) refuse(name, key, value, expected);
  };
  require(!device.empty(), "device", "", "a path such as /dev/video0");
  require(
      standard.empty() || standard == "auto" || detail::v4l2::standard_from_string(standard) != 0,
      "standard", standard, "auto, ntsc, pal, secam, ntsc-j, pal-m, pal-n or pal-60");
  require(format.empty() || detail::v4l2::fourcc_from_string(format) != 0, "format", format,
          "a four-character code such as GREY, Y16 or YUYV");
  require(
      field.empty() || detail::v4l2::field_from_string(field) != V4L2_FIELD_ANY, "field", field,
      "none, top, bottom, interlaced, interlaced-tb, interlaced-bt, seq-tb, seq-bt or alternate");
  require(buffers >= 4 && buffers <= 32, "buffers", std::to_string(buffers), "4 to 32");
  require(queue >= 1 && queue <= 16, "queue", std::to_string(queue), "1 to 16");
  require((width > 0) == (height > 0), "size", fmt::format("{}x{}", width, height), "both or none");
  require(stall_s > 0.0, "stall_s", std::to_string(stall_s), "more than 0");
  require(!(reconnect_s < 0.0), "reconnect", std::to_string(reconnect_s), "0 or more seconds");
}

}  // namespace striper
