// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core/types.hpp>

#include <striper/capture/source_uri.hpp>
#include <striper/core/event.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/illumination_pattern.hpp>

namespace striper {

/// How the laser is switched where the pattern has dark exposures or several lasers.
enum class LaserSwitching {
  kAuto,       ///< In the camera where it can, otherwise by the host.
  kSequencer,  ///< By the camera's own sequencer: full frame rate.
  kHost,       ///< By the host between exposures, each one triggered by software.
};

/// What an action command and a camera must agree on for the camera to act (GigE Vision 2.0, 14.3):
/// both keys the same, and a bit of the masks in common.
struct ActionKeys {
  std::uint32_t device_key = 0;
  std::uint32_t group_key = 0;
  std::uint32_t group_mask = 0;

  friend bool operator==(const ActionKeys&, const ActionKeys&) = default;
};

/// How a GigE Vision or USB3 Vision camera is opened and set up. What is not given stays as the
/// camera has it.
struct GigeOptions {
  std::string name;     ///< Serial, user name, IP, MAC, model or `vendor-serial`; empty: first.
  bool is_usb = false;  ///< USB3 Vision instead of GigE Vision.
  std::string uri;      ///< What it was opened by; made from `name` when empty.
  EventPort events;     ///< Hears what the camera and the network do.

  std::optional<std::string>
      pixel_format;  ///< `Mono8`, `Mono12Packed`; default: what is set, if it is understood.
  std::optional<cv::Rect> region;  ///< In pixels of the image, after binning.
  std::optional<cv::Size> binning;
  std::optional<double> exposure_us;
  std::optional<double> gain;  ///< In the camera's own unit, usually dB.
  std::optional<double> black_level;
  std::optional<double> frame_rate_hz;
  std::map<std::string, std::string> features;  ///< Any other feature by name, set last.

  /// The output lines that fire laser 0, 1, ...; empty: lasers are not the camera's business.
  std::vector<std::string> strobe_lines;
  LaserSwitching switching = LaserSwitching::kAuto;
  /// Empty or `off`: free-running; `software`; or a TriggerSource. `Action` is the first of those
  /// that are actions.
  std::string trigger;
  std::optional<ActionKeys> action;  ///< Those that the camera shall act on.
  IlluminationPattern pattern;       ///< `laser=`
  std::optional<Field> fields;       ///< `fields=`: the frames are two fields each.
  /// Whose counts come with each frame: `Encoder0`, `Counter1`, `yes` for what the camera has;
  /// empty: none.
  std::string encoder;

  int packet_bytes = 0;  ///< With IP and UDP headers; 0: the largest that arrives.
  std::optional<double> packet_delay_us;
  bool resend = true;
  std::chrono::milliseconds frame_timeout{100};  ///< A frame whose packets pause longer is lost.
  /// That hold frames until they are asked for. Not given: for half a second, which the
  /// reader may be late; at least 16, and beyond those no more than 256 MB.
  std::optional<int> buffers;
  int socket_buffer_mb = 32;
  std::chrono::milliseconds heartbeat{3000};  ///< After which the camera lets a dead host go.
  bool reconnect = true;
  /// The camera follows the network's PTP (IEEE 1588): times of day are PTP's, once it does.
  bool ptp = false;

  /// Reads `gige:NAME?key=value&...` or `u3v:...`; the keys are GigeSource's.
  /// @throws Error{kUsage} quoting key and value.
  static GigeOptions from_uri(SourceUri uri);

  /// @throws Error{kUsage} quoting what contradicts what.
  void validate() const;
};

}  // namespace striper
