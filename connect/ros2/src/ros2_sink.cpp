// SPDX-License-Identifier: Apache-2.0
#include "ros2_sink.hpp"

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/stream/messages/frame_messages.hpp>
#include <striper/stream/messages/head_messages.hpp>
#include <striper/stream/messages/scan_messages.hpp>

#include "ros_graph.hpp"
#include "ros_writer.hpp"

namespace striper::detail {
namespace {

using wire::RosQos;

// A head's topics begin with its name.
struct RosNames {
  std::string prefix;  // "/truck/front"

  RosNames(const Ros2Address& address, const std::string& head)
      : prefix((address.prefix.empty() ? "" : "/" + address.prefix) + "/" + head) {
    if (is_ros_name(head)) return;
    throw Error(ErrorKind::kBadValue,
                fmt::format("the head is called '{}', which is no name in ROS 2: letters, digits "
                            "and underscores, no digit first (serve --name)",
                            head));
  }
};

template <typename Message>
RosWriter writer_of(const DdsParticipant& participant, const std::string& topic, RosQos qos) {
  return {participant, topic, wire::schema_of<Message>(), qos};
}

FrameTime utc_now() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return {std::chrono::nanoseconds(now).count(), std::nullopt};
}

// One head's topics, and what its messages are made with.
struct RosHead {
  HeadInfo info;
  LaserScans scans;
  FrameTime last_time;
  bool is_name_taken_said = false;
  RosWriter points, scan, camera_info;
  std::optional<RosWriter> image;

  RosHead(const DdsParticipant& participant, const RosNames& names, RosQos qos, bool has_image)
      : points(writer_of<wire::PointCloud2>(participant, names.prefix + "/points", qos)),
        scan(writer_of<wire::LaserScan>(participant, names.prefix + "/scan", qos)),
        camera_info(writer_of<wire::CameraInfo>(participant, names.prefix + "/camera_info", qos)) {
    if (!has_image) return;
    const auto& schema = wire::schema_of<wire::Image>();
    image.emplace(participant, names.prefix + "/image_raw", schema, qos);
  }

  void set(const HeadInfo& head) {
    info = head;
    scans = head.model ? LaserScans(*head.model) : LaserScans();
  }
};

// What this process offers in a domain, made when the first head opens.
struct RosNode {
  DdsParticipant participant;
  RosGraph others;
  RosWriter tf_static, diagnostics;

  explicit RosNode(const Ros2Address& address)
      : participant(address),
        others(participant, RosGraph::Side::kWriters),
        tf_static(writer_of<wire::TFMessage>(participant, "/tf_static", RosQos::kLatched)),
        diagnostics(
            writer_of<wire::DiagnosticArray>(participant, "/diagnostics", RosQos::kReliable)) {}
};

class Ros2Sink : public ScanSink {
 public:
  explicit Ros2Sink(const Ros2Address& address) : address_(address) {}

  SinkNeeds needs() const override {
    SinkNeeds needs;
    needs.status = true;
    needs.frames_hz = address_.frames_hz;
    return needs;
  }

  void set_events(const EventPort& events) override { events_ = events; }
  void open(const HeadInfo& head) override;
  void write(const PolarScan& scan) override;
  void write(const Frame& frame) override;
  void status(const ScannerStatus& status) override;

 private:
  void add_head(const HeadInfo& head);
  RosHead* find_head(std::string_view name);
  RosHead& head_of(std::string_view name);
  void say_offer(const RosHead& head) const;
  void say_names_taken();
  void write_transforms();
  void write_camera(RosHead& head, const PixelGrid& pixels, const FrameTime& time);

  const Ros2Address address_;
  EventPort events_;
  std::optional<RosNode> node_;
  std::vector<std::unique_ptr<RosHead>> heads_;

  // Used again and again.
  wire::PointCloud2 points_;
  wire::LaserScan scan_;
  wire::CameraInfo camera_info_;
  wire::Image image_;
};

void Ros2Sink::open(const HeadInfo& head) {
  if (!node_) node_.emplace(address_);
  if (find_head(head.head) == nullptr) add_head(head);
  head_of(head.head).set(head);
  write_transforms();
}

void Ros2Sink::add_head(const HeadInfo& head) {
  const RosQos qos = address_.is_reliable ? RosQos::kReliable : RosQos::kBestEffort;
  heads_.push_back(std::make_unique<RosHead>(node_->participant, RosNames(address_, head.head), qos,
                                             address_.frames_hz > 0.0));
  heads_.back()->info.head = head.head;
  say_offer(*heads_.back());
}

RosHead* Ros2Sink::find_head(std::string_view name) {
  for (const auto& head : heads_) {
    if (head->info.head == name) return head.get();
  }
  return nullptr;
}

RosHead& Ros2Sink::head_of(std::string_view name) {
  if (RosHead* head = find_head(name)) return *head;
  throw Error(ErrorKind::kBadValue, fmt::format("ros2: head {} was not opened", name));
}

void Ros2Sink::say_offer(const RosHead& head) const {
  Event event(
      "topics_offered",
      fmt::format("{}, {} to ROS 2 programs of domain {} on {} (by {})", head.points.topic(),
                  head.scan.topic(), address_.domain, address_.where(), address_.interface_from),
      "where nobody hears them: `striper doctor --ros2`; other machines need interface=NAME or "
      "interface=auto, and the same ROS_DOMAIN_ID");
  event.head = head.info.head;
  events_.send(std::move(event));
}

// Readers would get the scans of both, mixed.
void Ros2Sink::say_names_taken() {
  for (const RosEndpoint& other : node_->others.take_new()) {
    for (const auto& head : heads_) {
      if (head->is_name_taken_said || other.topic != dds_topic_name(head->points.topic())) continue;
      head->is_name_taken_said = true;
      Event event("name_taken",
                  fmt::format("another program in ROS 2 domain {} publishes {} too",
                              address_.domain, head->points.topic()),
                  "give one of them another name: serve --name NAME, or ros2:PREFIX");
      event.head = head->info.head;
      events_.send(std::move(event));
    }
  }
}

// One message holds those of all heads: late readers get the last message alone.
void Ros2Sink::write_transforms() {
  wire::TFMessage all;
  for (const auto& head : heads_) {
    wire::TFMessage one;
    to_message(head->info, one);
    std::move(one.transforms.begin(), one.transforms.end(), std::back_inserter(all.transforms));
  }
  node_->tf_static.write(all);
}

void Ros2Sink::write(const PolarScan& scan) {
  RosHead& head = head_of(scan.head());
  head.last_time = scan.time;
  to_message(scan, points_);
  head.points.write(points_);
  if (head.scans.to_message(scan, scan_)) head.scan.write(scan_);
}

void Ros2Sink::write_camera(RosHead& head, const PixelGrid& pixels, const FrameTime& time) {
  if (!head.info.model) return;
  to_message(*head.info.model, head.info.head, pixels, camera_info_);
  camera_info_.header.stamp = to_stamp(time);
  head.camera_info.write(camera_info_);
}

void Ros2Sink::write(const Frame& frame) {
  RosHead& head = head_of(frame.head.empty() ? kDefaultHead : std::string_view(frame.head));
  write_camera(head, frame.grid, frame.time);
  to_message(frame, head.info.head + "_camera_optical", image_);
  if (head.image) head.image->write(image_);
}

void Ros2Sink::status(const ScannerStatus& status) {
  RosHead* head = find_head(status.head);
  if (head == nullptr) return;  // It comes before the first frame too.
  wire::DiagnosticArray message;
  to_message(status, message);
  message.header.stamp = to_stamp(utc_now());
  node_->diagnostics.write(message);
  if (!head->image) write_camera(*head, PixelGrid{}, head->last_time);
  say_names_taken();
}

}  // namespace

std::unique_ptr<ScanSink> make_ros2_sink(const Ros2Address& address) {
  return std::make_unique<Ros2Sink>(address);
}

}  // namespace striper::detail
