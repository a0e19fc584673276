// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <charconv>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/gige/gige_options.hpp>

#include "capture/common_keys.hpp"

namespace striper {
namespace {

constexpr std::string_view kKnown =
    "pixel_format, roi, binning, exposure_us, gain, black_level, fps, strobe, switching, trigger, "
    "action, encoder, packet_size, packet_delay_us, resend, frame_timeout_ms, buffers, "
    "socket_buffer_mb, "
    "heartbeat_ms, reconnect, "
    "ptp, laser, fields, feature.NAME, and the camera's own features by name, such as "
    "ExposureTime";

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  while (true) {
    const std::size_t end = text.find(separator, begin);
    parts.push_back(text.substr(begin, end - begin));
    if (end == std::string::npos) return parts;
    begin = end + 1;
  }
}

/// The numbers of `1,2,3`, or none at all where there are not `count` of them.
std::optional<std::vector<int>> whole_numbers(const std::string& text, char separator,
                                              std::size_t count) {
  std::vector<int> numbers;
  for (const std::string& part : split(text, separator)) {
    int number = 0;
    const auto [end, code] = std::from_chars(part.data(), part.data() + part.size(), number);
    if (code != std::errc() || end != part.data() + part.size() || number < 0) return std::nullopt;
    numbers.push_back(number);
  }
  if (numbers.size() != count) return std::nullopt;
  return numbers;
}

[[noreturn]] void refuse(const std::string& uri, std::string_view key, const std::string& value,
                         std::string_view expected) {
  throw Error(ErrorKind::kUsage,
              fmt::format("source '{}': {}={} - expected {}", uri, key, value, expected));
}

std::optional<cv::Rect> take_region(SourceUri& uri) {
  const auto text = uri.take("roi");
  if (!text) return std::nullopt;
  const auto n = whole_numbers(*text, ',', 4);
  if (!n || (*n)[2] == 0 || (*n)[3] == 0) {
    refuse(uri.text(), "roi", *text, "left,top,width,height in pixels");
  }
  return cv::Rect((*n)[0], (*n)[1], (*n)[2], (*n)[3]);
}

std::optional<cv::Size> take_binning(SourceUri& uri) {
  const auto text = uri.take("binning");
  if (!text) return std::nullopt;
  if (const auto one = whole_numbers(*text, 'x', 1); one && one->front() > 0) {
    return cv::Size(one->front(), one->front());
  }
  const auto two = whole_numbers(*text, 'x', 2);
  if (!two || (*two)[0] == 0 || (*two)[1] == 0) {
    refuse(uri.text(), "binning", *text, "2, or across x down as in 2x1");
  }
  return cv::Size((*two)[0], (*two)[1]);
}

/// A 32-bit number, decimal or `0x...`.
std::optional<std::uint32_t> key_of(std::string_view text) {
  const bool is_hexadecimal = text.starts_with("0x");
  if (is_hexadecimal) text.remove_prefix(2);
  std::uint32_t key = 0;
  const char* const last = text.data() + text.size();
  const auto [end, code] = std::from_chars(text.data(), last, key, is_hexadecimal ? 16 : 10);
  if (code != std::errc() || end != last) return std::nullopt;
  return key;
}

std::optional<ActionKeys> take_action(SourceUri& uri) {
  const auto text = uri.take("action");
  if (!text) return std::nullopt;
  const std::vector<std::string> parts = split(*text, ',');
  std::vector<std::uint32_t> keys;
  for (const std::string& part : parts) {
    if (const auto key = key_of(part)) keys.push_back(*key);
  }
  if (keys.size() != 3 || parts.size() != 3) {
    refuse(uri.text(), "action", *text,
           "device key, group key and group mask as in 0x1234,1,1, each below 2^32");
  }
  return ActionKeys{keys[0], keys[1], keys[2]};
}

std::string take_encoder(SourceUri& uri) {
  const auto word = uri.take("encoder");
  if (!word || *word == "no") return {};
  if (*word == "yes" || word->starts_with("Encoder") || word->starts_with("Counter")) return *word;
  refuse(uri.text(), "encoder", *word, "yes, no, or which one: Encoder0, Counter1");
}

LaserSwitching take_switching(SourceUri& uri) {
  const auto word = uri.take("switching");
  if (!word || *word == "auto") return LaserSwitching::kAuto;
  if (*word == "sequencer") return LaserSwitching::kSequencer;
  if (*word == "host") return LaserSwitching::kHost;
  refuse(uri.text(), "switching", *word, "auto, sequencer or host");
}

/// What is left: `feature.NAME=VALUE`, or `NAME=VALUE` with a capital, as GenICam writes names.
std::map<std::string, std::string> take_features(SourceUri& uri) {
  std::map<std::string, std::string> features;
  for (const auto& [key, value] : uri.take_rest()) {
    constexpr std::string_view kPrefix = "feature.";
    if (key.starts_with(kPrefix)) {
      features.emplace(key.substr(kPrefix.size()), value);
    } else if (std::isupper(static_cast<unsigned char>(key.front())) != 0) {
      features.emplace(key, value);
    } else {
      throw Error(ErrorKind::kUsage, fmt::format("source '{}': unknown key '{}'; {}: knows {}",
                                                 uri.text(), key, uri.scheme(), kKnown));
    }
  }
  return features;
}

}  // namespace

GigeOptions GigeOptions::from_uri(SourceUri uri) {
  GigeOptions options;
  const auto common = detail::CommonKeys::take(uri);
  options.pattern = common.pattern;
  options.fields = common.fields;
  options.uri = uri.text();
  options.name = uri.path();
  options.is_usb = uri.scheme() == "u3v";
  options.pixel_format = uri.take("pixel_format");
  options.region = take_region(uri);
  options.binning = take_binning(uri);
  options.exposure_us = uri.take_number("exposure_us", 0.0, 1e8);
  options.gain = uri.take_number("gain", -1e3, 1e6);
  options.black_level = uri.take_number("black_level", -1e6, 1e6);
  options.frame_rate_hz = uri.take_number("fps", 1e-3, 1e6);
  if (const auto lines = uri.take("strobe")) options.strobe_lines = split(*lines, ',');
  options.switching = take_switching(uri);
  options.trigger = uri.take("trigger").value_or("");
  options.action = take_action(uri);
  options.encoder = take_encoder(uri);
  options.packet_bytes = static_cast<int>(uri.take_integer("packet_size", 0, 65535).value_or(0));
  options.packet_delay_us = uri.take_number("packet_delay_us", 0.0, 1e6);
  options.resend = uri.take_bool("resend").value_or(options.resend);
  options.frame_timeout = std::chrono::milliseconds(
      uri.take_integer("frame_timeout_ms", 1, 60000).value_or(options.frame_timeout.count()));
  if (const auto count = uri.take_integer("buffers", 3, 1024)) {
    options.buffers = static_cast<int>(*count);
  }
  options.socket_buffer_mb = static_cast<int>(
      uri.take_integer("socket_buffer_mb", 0, 1000).value_or(options.socket_buffer_mb));
  options.heartbeat = std::chrono::milliseconds(
      uri.take_integer("heartbeat_ms", 1500, 60000).value_or(options.heartbeat.count()));
  options.reconnect = uri.take_bool("reconnect").value_or(options.reconnect);
  options.ptp = uri.take_bool("ptp").value_or(options.ptp);
  options.features = take_features(uri);
  return options;
}

void GigeOptions::validate() const {
  if (strobe_lines.empty() && switching != LaserSwitching::kAuto) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("source '{}': switching= needs strobe=, the line that the laser is on", uri));
  }
  if (action && !trigger.starts_with("Action")) {
    throw Error(ErrorKind::kUsage,
                fmt::format("source '{}': action= needs trigger=Action, or which one: Action1; "
                            "there is {}",
                            uri, trigger.empty() ? "no trigger=" : "trigger=" + trigger));
  }
  for (auto line = strobe_lines.begin(); line != strobe_lines.end(); ++line) {
    if (std::find(strobe_lines.begin(), line, *line) == line) continue;
    throw Error(ErrorKind::kUsage,
                fmt::format("source '{}': strobe= names {} twice - expected a line for each laser",
                            uri, *line));
  }
  for (const Illumination light : pattern.entries()) {
    if (strobe_lines.empty() || !light.is_lit()) continue;
    if (light.laser_index() >= static_cast<int>(strobe_lines.size())) {
      throw Error(ErrorKind::kUsage,
                  fmt::format("source '{}': laser={} names laser {}, strobe= has {} line{}", uri,
                              pattern.to_string(), light.laser_index(), strobe_lines.size(),
                              strobe_lines.size() == 1 ? "" : "s"));
    }
  }
}

}  // namespace striper
