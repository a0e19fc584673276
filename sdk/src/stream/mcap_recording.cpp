// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/stream/mcap_recording.hpp>
#include <striper/stream/messages/finding_messages.hpp>
#include <striper/stream/messages/frame_messages.hpp>
#include <striper/stream/messages/head_messages.hpp>
#include <striper/stream/messages/scan_messages.hpp>

namespace striper {
namespace {

using wire::McapSeries;

constexpr double kNsPerSecond = 1e9;

// A topic's number, with the bytes of its messages.
struct Topic {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
};

template <typename Message>
Topic add_topic(McapSeries& series, const std::string& name,
                wire::RosQos qos = wire::RosQos::kReliable) {
  return {series.add_channel(wire::ros_channel(name, wire::schema_of<Message>(), qos)), 0};
}

std::uint64_t log_time_of(const FrameTime& time) {
  return static_cast<std::uint64_t>(
      std::max<std::int64_t>(0, time.monotonic_ns + time.utc_offset_ns.value_or(0)));
}

wire::Time stamp_of(std::uint64_t log_time_ns) {
  return to_stamp({static_cast<std::int64_t>(log_time_ns), std::nullopt});
}

std::uint64_t log_time_of(const Event& event) {
  return std::isfinite(event.time_s) && event.time_s > 0.0
             ? static_cast<std::uint64_t>(event.time_s * kNsPerSecond)
             : 0;
}

bool is_recordable(const cv::Mat& image) {
  const int type = image.type();
  return !image.empty() &&
         (type == CV_8UC1 || type == CV_16UC1 || type == CV_8UC3 || type == CV_16UC3);
}

// What a mcap: source has to know before the first frame.
wire::McapMetadata source_metadata(const HeadInfo& head) {
  const SourceInfo& source = head.source;
  return {head.head + std::string(kSourceMetadata),
          {{"uri", source.uri},
           {"description", source.description},
           {"frame_info_version", "1"},
           {"image_width", fmt::to_string(source.image_size.width)},
           {"image_height", fmt::to_string(source.image_size.height)},
           {"sensor_width", fmt::to_string(source.sensor_size.width)},
           {"sensor_height", fmt::to_string(source.sensor_size.height)},
           {"bit_depth", fmt::to_string(source.bit_depth)},
           {"channels", fmt::to_string(source.channels)},
           {"field", fmt::to_string(static_cast<int>(source.field))},
           {"picture_rate_hz", fmt::format("{}", source.picture_rate_hz)},
           {"cadence", source.pattern.to_string()}}};
}

// One head's topics, and what its messages are made with.
struct RecordedHead {
  HeadInfo info;
  std::string optical_frame;
  Topic polar_scan, points, scan, image, camera_info, frame_info;
  std::optional<Topic> curbs, objects;  // Once there are any.
  LaserScans scans;

  RecordedHead(const HeadInfo& head, McapSeries& series)
      : optical_frame(head.head + "_camera_optical") {
    const std::string prefix = "/" + head.head;
    polar_scan = add_topic<wire::PolarScan>(series, prefix + std::string(kPolarScanTopic));
    points = add_topic<wire::PointCloud2>(series, prefix + "/points");
    scan = add_topic<wire::LaserScan>(series, prefix + "/scan");
    image = add_topic<wire::Image>(series, prefix + std::string(kImageTopic));
    camera_info = add_topic<wire::CameraInfo>(series, prefix + "/camera_info");
    frame_info = add_topic<wire::FrameInfo>(series, prefix + "/frame_info");
    set(head);
  }

  void set(const HeadInfo& head) {
    info = head;
    scans = head.model ? LaserScans(*head.model) : LaserScans();
  }
};

}  // namespace

class McapRecording::Impl {
 public:
  Impl(std::filesystem::path path, wire::McapRotation rotation)
      : path_(std::move(path)), rotation_(rotation) {}

  void open(const HeadInfo& head);
  void write(const PolarScan& scan);
  void write(const Frame& frame);
  void write(const ScannerStatus& status);
  void write(const Event& event);
  void write(const CurbsSeen& seen);
  void write(const ObjectsSeen& seen);
  void close() {
    if (series_) series_->close();
  }
  std::vector<std::filesystem::path> paths() const {
    return series_ ? series_->paths() : std::vector<std::filesystem::path>{};
  }

 private:
  RecordedHead& head_of(std::string_view name);
  void write_heads(std::uint64_t log_time_ns);
  void write_camera(RecordedHead& head, const PixelGrid& pixels, const FrameTime& time);
  Topic& events_of(const std::string& head);

  // The topic of something that not every recording has.
  template <typename Message>
  Topic& topic_of(std::optional<Topic>& topic, const std::string& head, std::string_view name) {
    if (!topic) topic = add_topic<Message>(*series_, fmt::format("/{}/{}", head, name));
    return *topic;
  }

  template <typename Message>
  void put(Topic& topic, const Message& message, std::uint64_t log_time_ns) {
    wire::write_cdr(message, bytes_);
    series_->write({topic.channel, topic.sequence++, log_time_ns, log_time_ns, bytes_});
  }

  std::filesystem::path path_;
  wire::McapRotation rotation_;
  std::optional<McapSeries> series_;
  std::vector<std::unique_ptr<RecordedHead>> heads_;
  std::vector<std::pair<std::string, Topic>> events_;
  Topic tf_static_;
  Topic diagnostics_;
  std::size_t files_begun_ = 0;    // That have the heads' transforms.
  std::uint64_t last_log_ns_ = 0;  // Of a frame or scan.
  std::vector<Event> early_;       // From before the first head.

  // Used again and again.
  std::vector<std::uint8_t> bytes_;
  wire::PolarScan polar_scan_;
  wire::PointCloud2 points_;
  wire::LaserScan scan_;
  wire::Image image_;
  wire::FrameInfo frame_info_;
  wire::CameraInfo camera_info_;
  wire::Curbs curbs_;
  wire::Objects objects_;
};

void McapRecording::Impl::open(const HeadInfo& head) {
  if (!series_) {
    series_.emplace(path_, rotation_);
    tf_static_ = add_topic<wire::TFMessage>(*series_, "/tf_static", wire::RosQos::kLatched);
    diagnostics_ = add_topic<wire::DiagnosticArray>(*series_, "/diagnostics");
  }
  const auto known = std::find_if(heads_.begin(), heads_.end(),
                                  [&](const auto& one) { return one->info.head == head.head; });
  if (known == heads_.end()) {
    heads_.push_back(std::make_unique<RecordedHead>(head, *series_));
    series_->add_metadata(source_metadata(head));
  } else {
    (*known)->set(head);
  }
  if (head.model) {
    series_->attach({head.head + std::string(kModelAttachment), "application/yaml", last_log_ns_,
                     last_log_ns_, format_model(*head.model)});
  }
  files_begun_ = 0;  // The transforms may be others.
  for (const Event& event : std::exchange(early_, {})) write(event);
}

RecordedHead& McapRecording::Impl::head_of(std::string_view name) {
  for (const auto& head : heads_) {
    if (head->info.head == name) return *head;
  }
  throw Error(ErrorKind::kBadValue,
              fmt::format("'{}': head {} was not opened", path_.string(), name));
}

// Each file of a series stands alone: transforms and cameras are in front of its other messages.
void McapRecording::Impl::write_heads(std::uint64_t log_time_ns) {
  last_log_ns_ = log_time_ns;
  if (files_begun_ == series_->paths().size()) return;
  files_begun_ = series_->paths().size();
  const wire::Time stamp = stamp_of(log_time_ns);
  wire::TFMessage all;
  for (const auto& head : heads_) {
    wire::TFMessage one;
    to_message(head->info, one);
    for (wire::TransformStamped& transform : one.transforms) {
      transform.header.stamp = stamp;
      all.transforms.push_back(std::move(transform));
    }
  }
  put(tf_static_, all, log_time_ns);
}

void McapRecording::Impl::write_camera(RecordedHead& head, const PixelGrid& pixels,
                                       const FrameTime& time) {
  if (!head.info.model) return;
  to_message(*head.info.model, head.info.head, pixels, camera_info_);
  camera_info_.header.stamp = to_stamp(time);
  put(head.camera_info, camera_info_, log_time_of(time));
}

void McapRecording::Impl::write(const PolarScan& scan) {
  RecordedHead& head = head_of(scan.head());
  const std::uint64_t log_time_ns = log_time_of(scan.time);
  write_heads(log_time_ns);
  to_message(scan, polar_scan_);
  put(head.polar_scan, polar_scan_, log_time_ns);
  to_message(scan, points_);
  put(head.points, points_, log_time_ns);
  if (head.scans.to_message(scan, scan_)) put(head.scan, scan_, log_time_ns);
}

void McapRecording::Impl::write(const Frame& frame) {
  RecordedHead& head = head_of(frame.head.empty() ? kDefaultHead : std::string_view(frame.head));
  const std::uint64_t log_time_ns = log_time_of(frame.time);
  write_heads(log_time_ns);
  if (is_recordable(frame.image)) {
    write_camera(head, frame.grid, frame.time);
    to_message(frame, head.optical_frame, image_);
    put(head.image, image_, log_time_ns);
  }
  to_message(frame, head.info.source.pattern, frame_info_);
  put(head.frame_info, frame_info_, log_time_ns);
}

void McapRecording::Impl::write(const ScannerStatus& status) {
  if (!series_ || last_log_ns_ == 0) return;  // Nothing to be beside yet.
  wire::DiagnosticArray message;
  to_message(status, message);
  message.header.stamp = stamp_of(last_log_ns_);
  put(diagnostics_, message, last_log_ns_);
}

Topic& McapRecording::Impl::events_of(const std::string& head) {
  for (auto& [name, topic] : events_) {
    if (name == head) return topic;
  }
  const std::string name = head.empty() ? std::string(kDefaultHead) : head;
  events_.emplace_back(head, add_topic<wire::Event>(*series_, "/" + name + "/events"));
  return events_.back().second;
}

// Where the source has no clock, an event is logged beside the frame that came before it: its own
// time, which its stamp keeps, is of another beginning.
void McapRecording::Impl::write(const Event& event) {
  if (!series_) {
    early_.push_back(event);
    return;
  }
  const bool has_clock = !heads_.empty() && heads_.front()->info.source.has_clock;
  wire::Event message;
  to_message(event, message);
  put(events_of(event.head), message, has_clock ? log_time_of(event) : last_log_ns_);
}

void McapRecording::Impl::write(const CurbsSeen& seen) {
  RecordedHead& head = head_of(seen.scan.head);
  to_message(seen, curbs_);
  put(topic_of<wire::Curbs>(head.curbs, seen.scan.head, "curbs"), curbs_,
      log_time_of(seen.scan.time));
}

void McapRecording::Impl::write(const ObjectsSeen& seen) {
  RecordedHead& head = head_of(seen.scan.head);
  to_message(seen, objects_);
  put(topic_of<wire::Objects>(head.objects, seen.scan.head, "objects"), objects_,
      log_time_of(seen.scan.time));
}

McapRecording::McapRecording(std::filesystem::path path, wire::McapRotation rotation)
    : impl_(std::make_unique<Impl>(std::move(path), rotation)) {}

McapRecording::~McapRecording() = default;

void McapRecording::open(const HeadInfo& head) { impl_->open(head); }
void McapRecording::write(const PolarScan& scan) { impl_->write(scan); }
void McapRecording::write(const Frame& frame) { impl_->write(frame); }
void McapRecording::write(const ScannerStatus& status) { impl_->write(status); }
void McapRecording::write(const Event& event) { impl_->write(event); }
void McapRecording::write(const CurbsSeen& seen) { impl_->write(seen); }
void McapRecording::write(const ObjectsSeen& seen) { impl_->write(seen); }
void McapRecording::close() { impl_->close(); }
std::vector<std::filesystem::path> McapRecording::paths() const { return impl_->paths(); }

}  // namespace striper
