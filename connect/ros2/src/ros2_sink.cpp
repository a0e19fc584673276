// SPDX-License-Identifier: Apache-2.0
#include "ros2_sink.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/stream/scan_topics.hpp>

#include "ros_graph.hpp"
#include "ros_node.hpp"
#include "ros_writer.hpp"

namespace striper::detail {
namespace {

using wire::RosQos;

std::string prefix_of(const Ros2Address& address) {
  return address.prefix.empty() ? "" : "/" + address.prefix;
}

void require_name(const std::string& head) {
  if (is_ros_name(head)) return;
  throw Error(ErrorKind::kBadValue,
              fmt::format("the head is called '{}', which is no name in ROS 2: letters, digits "
                          "and underscores, no digit first (serve --name)",
                          head));
}

ScanTopics::Options topics_of(const Ros2Address& address) {
  ScanTopics::Options options;
  options.prefix = prefix_of(address);
  options.qos = address.is_reliable ? RosQos::kReliable : RosQos::kBestEffort;
  options.images = address.images;
  return options;
}

// What this process offers in a domain, made when the first head opens.
class RosTopics : public TopicPort {
 public:
  explicit RosTopics(const Ros2Address& address)
      : participant(address),
        others(participant, RosGraph::Side::kWriters),
        announcer(participant, address.node),
        scans_(*this, topics_of(address)) {}

  int offer(const std::string& topic, const wire::MessageSchema& schema, RosQos qos) override {
    writers_.push_back(std::make_unique<RosWriter>(participant, topic, schema, qos));
    return static_cast<int>(writers_.size()) - 1;
  }

  void send(int topic, std::span<const std::uint8_t> cdr, std::int64_t /*time_ns*/) override {
    writers_[static_cast<std::size_t>(topic)]->write(cdr);
  }

  ScanTopics& scans() noexcept { return scans_; }

  /// Those of topics that begin so.
  std::vector<dds_guid_t> writers_of(std::string_view prefix) const {
    std::vector<dds_guid_t> found;
    for (const auto& writer : writers_) {
      if (writer->topic().starts_with(prefix)) found.push_back(writer->guid());
    }
    return found;
  }

  DdsParticipant participant;
  RosGraph others;
  RosNodeAnnouncer announcer;

 private:
  std::vector<std::unique_ptr<RosWriter>> writers_;
  ScanTopics scans_;
};

// A head that was opened.
struct RosHead {
  std::string name;
  std::string prefix;  // Of its topics: "/truck/front/".
  bool is_name_taken_said = false;

  std::string points() const { return prefix + "points"; }
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
  void write(const PolarScan& scan) override { topics_->scans().write(scan); }
  void write(const Frame& frame) override { topics_->scans().write(frame); }
  void curbs(const CurbsSeen& seen) override { topics_->scans().curbs(seen); }
  void objects(const ObjectsSeen& seen) override { topics_->scans().objects(seen); }
  void status(const ScannerStatus& status) override;

 private:
  void add_head(const std::string& name);
  void say_offer(const RosHead& head) const;
  void hear_others();
  void say_name_taken(const RosEndpoint& other);
  void announce_nodes();
  void say_announced(RosRelease release) const;

  const Ros2Address address_;
  EventPort events_;
  std::optional<RosTopics> topics_;
  std::vector<RosHead> heads_;
};

void Ros2Sink::open(const HeadInfo& head) {
  require_name(head.head);
  if (!topics_) topics_.emplace(address_);
  topics_->scans().open(head);
  const auto is_it = [&](const RosHead& known) { return known.name == head.head; };
  if (std::none_of(heads_.begin(), heads_.end(), is_it)) add_head(head.head);
  announce_nodes();
}

void Ros2Sink::add_head(const std::string& name) {
  heads_.push_back({name, prefix_of(address_) + "/" + name + "/"});
  say_offer(heads_.back());
}

void Ros2Sink::say_offer(const RosHead& head) const {
  Event event(
      "topics_offered",
      fmt::format("{}, {}scan to ROS 2 programs of domain {} on {} (by {})", head.points(),
                  head.prefix, address_.domain, address_.where(), address_.interface_from),
      "where nobody hears them: `striper doctor --ros2`; other machines need interface=NAME or "
      "interface=auto, and the same ROS_DOMAIN_ID");
  event.head = head.name;
  events_.send(std::move(event));
}

void Ros2Sink::hear_others() {
  for (const RosEndpoint& other : topics_->others.take_new()) {
    say_name_taken(other);
    topics_->announcer.hear(other);
  }
}

// Readers would get the scans of both, mixed.
void Ros2Sink::say_name_taken(const RosEndpoint& other) {
  for (RosHead& head : heads_) {
    if (head.is_name_taken_said || other.topic != dds_topic_name(head.points())) continue;
    head.is_name_taken_said = true;
    Event event("name_taken",
                fmt::format("another program in ROS 2 domain {} publishes {} too", address_.domain,
                            head.points()),
                "give one of them another name: serve --name NAME, or ros2:PREFIX");
    event.head = head.name;
    events_.send(std::move(event));
  }
}

// A node a head, by its name; what is of all heads is with the first one's.
void Ros2Sink::announce_nodes() {
  std::vector<RosNodeEntry> nodes;
  for (const RosHead& head : heads_) {
    nodes.push_back({"/" + address_.prefix, head.name, topics_->writers_of(head.prefix)});
  }
  if (nodes.empty()) return;
  for (const char* const shared : {"/tf_static", "/diagnostics"}) {
    for (const dds_guid_t& writer : topics_->writers_of(shared)) {
      nodes.front().writers.push_back(writer);
    }
  }
  if (const auto release = topics_->announcer.announce(nodes)) say_announced(*release);
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

void Ros2Sink::status(const ScannerStatus& status) {
  if (!topics_) return;  // It comes before the first frame too.
  topics_->scans().status(status);
  hear_others();
  if (topics_->announcer.is_due()) announce_nodes();
}

}  // namespace

std::unique_ptr<ScanSink> make_ros2_sink(const Ros2Address& address) {
  return std::make_unique<Ros2Sink>(address);
}

}  // namespace striper::detail
