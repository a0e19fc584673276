// SPDX-License-Identifier: Apache-2.0
#include "gige/control/camera_setup.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/core/error.hpp>
#include <striper/core/event.hpp>

#include "gige/clock/ptp_clock.hpp"
#include "gige/protocol/gvcp.hpp"

namespace striper::detail {
namespace {

void set_binning(const FeatureAccess& features, cv::Size binning) {
  features.set_integer(features.need_one_of("binning", {"BinningHorizontal"}), binning.width);
  features.set_integer(features.need_one_of("binning", {"BinningVertical"}), binning.height);
}

const PixelLayout* set_pixel_format(const FeatureAccess& features, const GigeOptions& options) {
  if (options.pixel_format) {
    if (find_layout(*options.pixel_format) == nullptr) {
      std::vector<std::string_view> names;
      for (const PixelLayout& layout : known_layouts()) names.push_back(layout.name);
      throw Error(ErrorKind::kUsage,
                  fmt::format("source '{}': pixel_format={} - expected one of {}", options.uri,
                              *options.pixel_format, fmt::join(names, ", ")));
    }
    features.set("PixelFormat", *options.pixel_format);
  }
  const auto code = static_cast<std::uint32_t>(features.integer("PixelFormat"));
  if (const PixelLayout* const layout = find_layout(code)) return layout;
  for (const PixelLayout& layout : known_layouts()) {
    const std::string name(layout.name);
    if (!features.has_entry("PixelFormat", name)) continue;
    features.set("PixelFormat", name);
    return &layout;
  }
  throw Error(ErrorKind::kUnsupported,
              fmt::format("{}: none of its pixel formats is understood: {}", features.device_name(),
                          fmt::join(features.entries("PixelFormat"), ", ")));
}

/// The offsets limit the size and the size the offsets: so the offsets go to zero first.
void set_region(const FeatureAccess& features, const cv::Rect& region) {
  features.need_one_of("region of interest", {"OffsetX"});
  features.need_one_of("region of interest", {"OffsetY"});
  features.set_integer("OffsetX", 0);
  features.set_integer("OffsetY", 0);
  features.set_integer("Width", region.width);
  features.set_integer("Height", region.height);
  features.set_integer("OffsetX", region.x);
  features.set_integer("OffsetY", region.y);
}

void set_rate(const FeatureAccess& features, double rate_hz) {
  if (features.has("AcquisitionFrameRateEnable")) features.set("AcquisitionFrameRateEnable", "yes");
  features.set_number(
      features.need_one_of("frame rate", {"AcquisitionFrameRate", "AcquisitionFrameRateAbs"}),
      rate_hz);
}

void set_light(const FeatureAccess& features, const GigeOptions& options) {
  if (options.exposure_us) set_exposure(features, *options.exposure_us);
  if (options.gain) set_gain(features, *options.gain);
  if (options.black_level) {
    features.try_set("BlackLevelAuto", "Off");
    features.set_number(features.need_one_of("black level", {"BlackLevel", "BlackLevelRaw"}),
                        *options.black_level);
  }
  if (options.frame_rate_hz) set_rate(features, *options.frame_rate_hz);
}

/// Binning averages pixels, decimation leaves some out: both make the step, binning moves the
/// centre.
AxisGrid axis_grid(const FeatureAccess& features, const char* offset, const char* binning,
                   const char* decimation) {
  const auto bins = static_cast<double>(features.find_integer(binning).value_or(1));
  const auto skips = static_cast<double>(features.find_integer(decimation).value_or(1));
  const auto first = static_cast<double>(features.find_integer(offset).value_or(0));
  const double step = bins * skips;
  return {first * step + 0.5 * (bins - 1.0), step};
}

int sensor_extent(const FeatureAccess& features, const char* sensor, const char* largest,
                  double step) {
  if (const auto pixels = features.find_integer(sensor)) return static_cast<int>(*pixels);
  if (const auto pixels = features.find_integer(largest)) {
    return static_cast<int>(std::llround(static_cast<double>(*pixels) * step));
  }
  throw Error(ErrorKind::kUnsupported,
              fmt::format("{}: the size of its sensor is unknown: it has no "
                          "feature {} or {}",
                          features.device_name(), sensor, largest));
}

void check_rows_are_whole_bytes(const FeatureAccess& features, const FrameSetup& setup) {
  const std::size_t bits =
      static_cast<std::size_t>(setup.size.width) * setup.layout->bits_per_pixel();
  if (bits % 8 == 0) return;
  throw Error(
      ErrorKind::kUsage,
      fmt::format("{}: Width={} - expected a multiple of {} with {}: its rows must be whole "
                  "bytes",
                  features.device_name(), setup.size.width,
                  setup.layout->bits_per_pixel() == 12 ? 2 : 4, setup.layout->name));
}

/// A camera that does not take it keeps its own: a dead host is let go later, that is all.
void set_heartbeat(const FeatureAccess& features, const GigeOptions& options) {
  const auto wanted_ms = static_cast<guint32>(options.heartbeat.count());
  guint32 kept_ms = 0;
  CallError error;
  arv_device_write_register(features.device(), gvcp::kHeartbeatTimeout, wanted_ms, error.slot());
  if (!error) {
    arv_device_read_register(features.device(), gvcp::kHeartbeatTimeout, &kept_ms, error.slot());
  }
  if (!error && kept_ms == wanted_ms) return;
  options.events.send(
      {"setting_adjusted",
       fmt::format("{}: heartbeat_ms={} is not taken: {}", features.device_name(), wanted_ms,
                   error ? error.message() : fmt::format("the camera keeps {}", kept_ms))});
}

/// Before it is written: what Aravis says of a refused register is for its makers.
void check_packet_size(ArvCamera* camera, const FeatureAccess& features, int packet_bytes) {
  gint64 low = 0;
  gint64 high = 0;
  CallError error;
  arv_camera_get_integer_bounds(camera, "GevSCPSPacketSize", &low, &high, error.slot());
  if (error || (packet_bytes >= low && packet_bytes <= high)) return;
  constexpr gint64 kLargest_bytes = 0xffff;  // The register has 16 bits for it.
  throw Error(ErrorKind::kUsage,
              fmt::format("{}: packet_size={} - the camera allows {} to {}", features.device_name(),
                          packet_bytes, low, std::min(high, kLargest_bytes)));
}

void set_packet_delay(ArvCamera* camera, const FeatureAccess& features, double delay_us) {
  features.need_one_of("pause between packets", {"GevSCPD"});
  CallError error;
  const gint64 wanted_ns = std::llround(1e3 * delay_us);
  arv_camera_gv_set_packet_delay(camera, wanted_ns, error.slot());
  gint64 kept_ns = 0;
  if (!error) kept_ns = arv_camera_gv_get_packet_delay(camera, error.slot());
  // The camera counts in ticks of its clock: up to a microsecond off is rounding.
  constexpr gint64 kRounding_ns = 1000;
  if (!error && std::abs(kept_ns - wanted_ns) <= kRounding_ns) return;
  throw Error(ErrorKind::kDevice,
              fmt::format("{}: packet_delay_us={} - the camera took {} {}", features.device_name(),
                          delay_us, 1e-3 * static_cast<double>(kept_ns), error.message()));
}

constexpr std::string_view kAction = "Action";

/// `Action` stands for the first action among the camera's trigger sources, whatever its number.
std::string trigger_source(const FeatureAccess& features, const std::string& wanted) {
  if (wanted != kAction || !features.has("TriggerSource")) return wanted;
  for (const std::string& source : features.entries("TriggerSource")) {
    if (source.starts_with(wanted)) return source;
  }
  return wanted;  // which is refused, naming those that there are
}

/// @param source the trigger's: `Action1` is the action that ActionSelector calls 1.
void set_action_keys(const FeatureAccess& features, const ActionKeys& keys,
                     const std::string& source) {
  constexpr const char* kActionKeys = "action keys";
  const std::string number = source.substr(std::min(kAction.size(), source.size()));
  const bool is_number =
      !number.empty() && number.find_first_not_of("0123456789") == std::string::npos;
  if (source.starts_with(kAction) && is_number) features.try_set("ActionSelector", number);
  // The standard lets nobody read it: who knows it may trigger.
  features.write_integer(features.need_one_of(kActionKeys, {"ActionDeviceKey"}), keys.device_key);
  features.set_integer(features.need_one_of(kActionKeys, {"ActionGroupKey"}), keys.group_key);
  features.set_integer(features.need_one_of(kActionKeys, {"ActionGroupMask"}), keys.group_mask);
}

/// Where a camera keeps what a wheel's encoder shows, by the Standard Features Naming Convention
/// (GenICam SFNC 2.7, 18 Chunk Data Control).
struct EncoderChunk {
  const char* kind;      // How its sources are called: Encoder0, Counter1.
  const char* entry;     // Of ChunkSelector.
  const char* selector;  // Which encoder or counter.
  const char* value;
};
constexpr EncoderChunk kEncoderChunks[] = {
    {"Encoder", "EncoderValue", "ChunkEncoderSelector", "ChunkEncoderValue"},
    {"Counter", "CounterValue", "ChunkCounterSelector", "ChunkCounterValue"},
};

}  // namespace

void set_exposure(const FeatureAccess& features, double exposure_us) {
  features.try_set("ExposureAuto", "Off");
  features.set_number(
      features.need_one_of("exposure", {"ExposureTime", "ExposureTimeAbs", "ExposureTimeRaw"}),
      exposure_us);
}

void set_gain(const FeatureAccess& features, double gain) {
  features.try_set("GainAuto", "Off");
  features.set_number(features.need_one_of("gain", {"Gain", "GainAbs", "GainRaw"}), gain);
}

const char* enable_encoder_chunk(const FeatureAccess& features, const GigeOptions& options) {
  if (options.encoder.empty()) return nullptr;
  features.need_one_of("encoder", {"ChunkModeActive"});
  features.set("ChunkModeActive", "yes");
  for (const EncoderChunk& chunk : kEncoderChunks) {
    const bool is_meant = options.encoder == "yes" || options.encoder.starts_with(chunk.kind);
    if (!is_meant || !features.has_entry("ChunkSelector", chunk.entry)) continue;
    features.set("ChunkSelector", chunk.entry);
    features.set("ChunkEnable", "yes");
    if (options.encoder != "yes") features.set(chunk.selector, options.encoder);
    return chunk.value;
  }
  throw Error(ErrorKind::kUnsupported,
              fmt::format("{}: encoder={}: its frames come without EncoderValue and CounterValue; "
                          "ChunkSelector has {}",
                          features.device_name(), options.encoder,
                          fmt::join(features.entries("ChunkSelector"), ", ")));
}

FrameSetup set_up_frames(const FeatureAccess& features, const GigeOptions& options) {
  features.try_set("AcquisitionMode", "Continuous");
  if (options.binning) set_binning(features, *options.binning);
  FrameSetup setup;
  setup.layout = set_pixel_format(features, options);
  if (options.region) set_region(features, *options.region);
  set_light(features, options);
  if (options.ptp) enable_ptp(features);
  for (const auto& [name, value] : options.features) features.set(name.c_str(), value);
  if (!options.pixel_format) setup.layout = set_pixel_format(features, options);

  setup.size = cv::Size(static_cast<int>(features.integer("Width")),
                        static_cast<int>(features.integer("Height")));
  setup.grid.u = axis_grid(features, "OffsetX", "BinningHorizontal", "DecimationHorizontal");
  setup.grid.v = axis_grid(features, "OffsetY", "BinningVertical", "DecimationVertical");
  setup.sensor_size = {sensor_extent(features, "SensorWidth", "WidthMax", setup.grid.u.step),
                       sensor_extent(features, "SensorHeight", "HeightMax", setup.grid.v.step)};
  check_rows_are_whole_bytes(features, setup);

  if (const char* const name = features.first_of({"ExposureTime", "ExposureTimeAbs"})) {
    setup.exposure_ns = std::llround(1e3 * features.number(name));
  }
  if (const char* const name =
          features.first_of({"ResultingFrameRate", "ResultingFrameRateAbs", "AcquisitionFrameRate",
                             "AcquisitionFrameRateAbs"})) {
    setup.rate_hz = features.number(name);
  }
  return setup;
}

void set_up_trigger(const FeatureAccess& features, const GigeOptions& options, bool by_host) {
  features.try_set("TriggerSelector", "FrameStart");
  const std::string source = by_host ? "Software" : trigger_source(features, options.trigger);
  if (options.action) {
    set_action_keys(features, *options.action, source);
  } else if (source.starts_with(kAction)) {
    options.events.send(
        {"setting_unlikely",
         fmt::format("{}: trigger={} without action=: the camera acts on the keys that it has, "
                     "whoever set them",
                     features.device_name(), options.trigger)});
  }
  const bool is_free = !by_host && (options.trigger.empty() || options.trigger == "off");
  if (is_free) {
    features.try_set("TriggerMode", "Off");
    return;
  }
  features.need_one_of("trigger", {"TriggerMode"});
  if (by_host) features.need_one_of("software trigger", {"TriggerSoftware"});
  features.set("TriggerSource", source);
  features.set("TriggerMode", "On");
}

int set_up_transport(ArvCamera* camera, const FeatureAccess& features, const GigeOptions& options) {
  if (arv_camera_is_gv_device(camera) == FALSE) return 0;
  CallError error;
  set_heartbeat(features, options);
  arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  if (options.packet_bytes > 0) {
    check_packet_size(camera, features, options.packet_bytes);
    arv_camera_gv_set_packet_size(camera, options.packet_bytes, error.slot());
  } else {
    arv_camera_gv_auto_packet_size(camera, error.slot());
  }
  const int packet_bytes = static_cast<int>(arv_camera_gv_get_packet_size(camera, nullptr));
  if (error || (options.packet_bytes > 0 && packet_bytes != options.packet_bytes)) {
    const std::string wanted = options.packet_bytes > 0
                                   ? fmt::format("packet_size={}", options.packet_bytes)
                                   : "the largest packets that the network takes";
    throw Error(ErrorKind::kDevice,
                fmt::format("{}: {} - the camera took {} {}", features.device_name(), wanted,
                            packet_bytes, error.message()));
  }
  if (options.packet_delay_us) set_packet_delay(camera, features, *options.packet_delay_us);
  return packet_bytes;
}

}  // namespace striper::detail
