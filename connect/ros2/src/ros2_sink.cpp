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

#include "compressed_image.hpp"
#include "ros_graph.hpp"
#include "ros_node.hpp"
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

RosQos qos_of(const Ros2Address& address) {
  return address.is_reliable ? RosQos::kReliable : RosQos::kBestEffort;
}

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
  std::optional<RosWriter> image, compressed;

  RosHead(const DdsParticipant& participant, const RosNames& names, RosQos qos)
      : points(writer_of<wire::PointCloud2>(participant, names.prefix + "/points", qos)),
        scan(writer_of<wire::LaserScan>(participant, names.prefix + "/scan", qos)),
        camera_info(writer_of<wire::CameraInfo>(participant, names.prefix + "/camera_info", qos)) {}

  void offer_images(const DdsParticipant& participant, const Ros2Address& address) {
    if (address.frames_hz <= 0.0) return;
    const RosNames names(address, info.head);
    const RosQos qos = qos_of(address);
    const std::string topic = names.prefix + "/image_raw";
    if (address.images != RosImages::kCompressed) {
      image.emplace(participant, topic, wire::schema_of<wire::Image>(), qos);
    }
    if (address.images != RosImages::kRaw) {
      const auto& schema = wire::schema_of<wire::CompressedImage>();
      compressed.emplace(participant, topic + "/compressed", schema, qos);
    }
  }

  bool has_images() const noexcept { return image || compressed; }

  std::vector<const RosWriter*> writers() const {
    std::vector<const RosWriter*> all = {&points, &scan, &camera_info};
    if (image) all.push_back(&*image);
    if (compressed) all.push_back(&*compressed);
    return all;
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
  RosNodeAnnouncer announcer;

  explicit RosNode(const Ros2Address& address)
      : participant(address),
        others(participant, RosGraph::Side::kWriters),
        tf_static(writer_of<wire::TFMessage>(participant, "/tf_static", RosQos::kLatched)),
        diagnostics(
            writer_of<wire::DiagnosticArray>(participant, "/diagnostics", RosQos::kReliable)),
        announcer(participant, address.node) {}
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
  void hear_others();
  void say_name_taken(const RosEndpoint& other);
  void announce_nodes();
  void say_announced(RosRelease release) const;
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
  wire::CompressedImage compressed_;
};

void Ros2Sink::open(const HeadInfo& head) {
  if (!node_) node_.emplace(address_);
  if (find_head(head.head) == nullptr) add_head(head);
  head_of(head.head).set(head);
  write_transforms();
  announce_nodes();
}

void Ros2Sink::add_head(const HeadInfo& head) {
  heads_.push_back(std::make_unique<RosHead>(node_->participant, RosNames(address_, head.head),
                                             qos_of(address_)));
  heads_.back()->info.head = head.head;
  heads_.back()->offer_images(node_->participant, address_);
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

void Ros2Sink::hear_others() {
  for (const RosEndpoint& other : node_->others.take_new()) {
    say_name_taken(other);
    node_->announcer.hear(other);
  }
}

// Readers would get the scans of both, mixed.
void Ros2Sink::say_name_taken(const RosEndpoint& other) {
  for (const auto& head : heads_) {
    if (head->is_name_taken_said || other.topic != dds_topic_name(head->points.topic())) continue;
    head->is_name_taken_said = true;
    Event event("name_taken",
                fmt::format("another program in ROS 2 domain {} publishes {} too", address_.domain,
                            head->points.topic()),
                "give one of them another name: serve --name NAME, or ros2:PREFIX");
    event.head = head->info.head;
    events_.send(std::move(event));
  }
}

// A node a head, by its name; what is of all heads is with the first one's.
void Ros2Sink::announce_nodes() {
  std::vector<RosNodeEntry> nodes;
  for (const auto& head : heads_) {
    RosNodeEntry& node = nodes.emplace_back();
    node.name_space = "/" + address_.prefix;
    node.name = head->info.head;
    for (const RosWriter* writer : head->writers()) node.writers.push_back(writer->guid());
  }
  if (nodes.empty()) return;
  for (const RosWriter* writer : {&node_->tf_static, &node_->diagnostics}) {
    nodes.front().writers.push_back(writer->guid());
  }
  if (const auto release = node_->announcer.announce(nodes)) say_announced(*release);
}

void Ros2Sink::say_announced(RosRelease release) const {
  switch (release) {
    case RosRelease::kHumble:
      events_.send(Event("node_announced", "ROS 2 programs are told of the node as Humble has it"));
      return;
    case RosRelease::kIron:
      events_.send(
          Event("node_announced", "ROS 2 programs are told of the node as Iron and later have it"));
      return;
    case RosRelease::kBoth:
      events_.send(Event("node_withheld",
                         "programs of Humble and of later releases are in one domain: the node is "
                         "not told of, which would end Humble's",
                         "give each release a ROS_DOMAIN_ID of its own; topics are heard all the "
                         "same"));
      return;
    case RosRelease::kNone:
      return;
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
  const std::string frame_id = head.info.head + "_camera_optical";
  if (head.image) {
    to_message(frame, frame_id, image_);
    head.image->write(image_);
  }
  if (!head.compressed) return;
  to_message(frame, frame_id, compressed_);
  head.compressed->write(compressed_);
}

void Ros2Sink::status(const ScannerStatus& status) {
  RosHead* head = find_head(status.head);
  if (head == nullptr) return;  // It comes before the first frame too.
  wire::DiagnosticArray message;
  to_message(status, message);
  message.header.stamp = to_stamp(utc_now());
  node_->diagnostics.write(message);
  if (!head->has_images()) write_camera(*head, PixelGrid{}, head->last_time);
  hear_others();
  if (node_->announcer.is_due()) announce_nodes();
}

}  // namespace

std::unique_ptr<ScanSink> make_ros2_sink(const Ros2Address& address) {
  return std::make_unique<Ros2Sink>(address);
}

}  // namespace striper::detail
