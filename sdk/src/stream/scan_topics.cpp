// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/stream/messages/compressed_image.hpp>
#include <striper/stream/messages/finding_messages.hpp>
#include <striper/stream/messages/frame_messages.hpp>
#include <striper/stream/messages/head_messages.hpp>
#include <striper/stream/messages/scan_messages.hpp>
#include <striper/stream/scan_topics.hpp>

namespace striper {
namespace {

using wire::RosQos;

constexpr int kNoTopic = -1;

std::int64_t time_ns(const wire::Time& stamp) noexcept {
  return std::int64_t{1'000'000'000} * stamp.sec + stamp.nanosec;
}

FrameTime utc_now() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return {std::chrono::nanoseconds(now).count(), std::nullopt};
}

struct HeadTopics {
  HeadInfo info;
  LaserScans scans;
  FrameTime last_time;
  int points = kNoTopic, scan = kNoTopic, camera_info = kNoTopic;
  int image = kNoTopic, compressed = kNoTopic;
  int polar_scan = kNoTopic, frame_info = kNoTopic;
  int curbs = kNoTopic, objects = kNoTopic;

  void set(const HeadInfo& head) {
    info = head;
    scans = head.model ? LaserScans(*head.model) : LaserScans();
  }
};

}  // namespace

struct ScanTopics::Impl {
  TopicPort& port;
  Options options;
  int tf_static, diagnostics;
  std::vector<std::unique_ptr<HeadTopics>> heads;

  // Used again and again.
  std::vector<std::uint8_t> bytes;
  wire::PointCloud2 points;
  wire::LaserScan scan;
  wire::CameraInfo camera_info;
  wire::Image image;
  wire::CompressedImage compressed;
  wire::PolarScan polar_scan;
  wire::FrameInfo frame_info;
  wire::Curbs curbs;
  wire::Objects objects;

  Impl(TopicPort& to, Options wanted) : port(to), options(std::move(wanted)) {
    tf_static = offer<wire::TFMessage>("/tf_static", RosQos::kLatched);
    diagnostics = offer<wire::DiagnosticArray>("/diagnostics", RosQos::kReliable);
  }

  template <typename Message>
  int offer(const std::string& topic, RosQos qos) {
    return port.offer(topic, wire::schema_of<Message>(), qos);
  }

  template <typename Message>
  void send(int topic, const Message& message, const wire::Time& stamp) {
    wire::write_cdr(message, bytes);
    port.send(topic, bytes, time_ns(stamp));
  }

  // What was found in a head's scan; its topic is offered with the first.
  template <typename Seen, typename Message>
  void send_found(const Seen& seen, const char* name, int HeadTopics::*at, Message& message) {
    HeadTopics& head = head_of(seen.scan.head);
    int& topic = head.*at;
    if (topic == kNoTopic) {
      topic = offer<Message>(fmt::format("{}/{}/{}", options.prefix, head.info.head, name),
                             options.qos);
    }
    if (!is_wanted(topic)) return;
    to_message(seen, message);
    send(topic, message, message.header.stamp);
  }

  bool is_wanted(int topic) const { return topic != kNoTopic && port.is_wanted(topic); }

  HeadTopics* find(std::string_view name) {
    for (const auto& head : heads) {
      if (head->info.head == name) return head.get();
    }
    return nullptr;
  }

  HeadTopics& head_of(std::string_view name) {
    if (HeadTopics* head = find(name)) return *head;
    throw Error(ErrorKind::kBadValue, fmt::format("topics: head {} was not opened", name));
  }

  void add(const std::string& name) {
    auto head = std::make_unique<HeadTopics>();
    head->info.head = name;
    const std::string prefix = options.prefix + "/" + name;
    head->points = offer<wire::PointCloud2>(prefix + "/points", options.qos);
    head->scan = offer<wire::LaserScan>(prefix + "/scan", options.qos);
    head->camera_info = offer<wire::CameraInfo>(prefix + "/camera_info", options.qos);
    const TopicImages images = options.images;
    if (images == TopicImages::kRaw || images == TopicImages::kBoth) {
      head->image = offer<wire::Image>(prefix + "/image_raw", options.qos);
    }
    if (images == TopicImages::kCompressed || images == TopicImages::kBoth) {
      head->compressed =
          offer<wire::CompressedImage>(prefix + "/image_raw/compressed", options.qos);
    }
    if (options.has_own_messages) {
      head->polar_scan = offer<wire::PolarScan>(prefix + "/polar_scan", options.qos);
      head->frame_info = offer<wire::FrameInfo>(prefix + "/frame_info", options.qos);
    }
    heads.push_back(std::move(head));
  }

  // One message holds those of all heads: late readers get the last message alone.
  void send_transforms() {
    wire::TFMessage all;
    for (const auto& head : heads) {
      wire::TFMessage one;
      to_message(head->info, one);
      std::move(one.transforms.begin(), one.transforms.end(), std::back_inserter(all.transforms));
    }
    send(tf_static, all, to_stamp(utc_now()));
  }

  void send_camera(HeadTopics& head, const PixelGrid& pixels, const FrameTime& time) {
    if (!head.info.model || !is_wanted(head.camera_info)) return;
    to_message(*head.info.model, head.info.head, pixels, camera_info);
    camera_info.header.stamp = to_stamp(time);
    send(head.camera_info, camera_info, camera_info.header.stamp);
  }
};

std::optional<TopicImages> topic_images_from_string(std::string_view word) noexcept {
  if (word == "raw") return TopicImages::kRaw;
  if (word == "compressed") return TopicImages::kCompressed;
  if (word == "both") return TopicImages::kBoth;
  return std::nullopt;
}

ScanTopics::ScanTopics(TopicPort& port, Options options)
    : impl_(std::make_unique<Impl>(port, std::move(options))) {}
ScanTopics::~ScanTopics() = default;

void ScanTopics::open(const HeadInfo& head) {
  if (impl_->find(head.head) == nullptr) impl_->add(head.head);
  impl_->head_of(head.head).set(head);
  impl_->send_transforms();
}

void ScanTopics::write(const PolarScan& scan) {
  HeadTopics& head = impl_->head_of(scan.head());
  head.last_time = scan.time;
  if (impl_->is_wanted(head.points)) {
    to_message(scan, impl_->points);
    impl_->send(head.points, impl_->points, impl_->points.header.stamp);
  }
  if (impl_->is_wanted(head.scan) && head.scans.to_message(scan, impl_->scan)) {
    impl_->send(head.scan, impl_->scan, impl_->scan.header.stamp);
  }
  if (!impl_->is_wanted(head.polar_scan)) return;
  to_message(scan, impl_->polar_scan);
  impl_->send(head.polar_scan, impl_->polar_scan, impl_->polar_scan.header.stamp);
}

void ScanTopics::write(const Frame& frame) {
  HeadTopics& head =
      impl_->head_of(frame.head.empty() ? kDefaultHead : std::string_view(frame.head));
  impl_->send_camera(head, frame.grid, frame.time);
  const std::string frame_id = head.info.head + "_camera_optical";
  if (impl_->is_wanted(head.frame_info)) {
    to_message(frame, head.info.source.pattern, impl_->frame_info);
    impl_->send(head.frame_info, impl_->frame_info, to_stamp(frame.time));
  }
  if (impl_->is_wanted(head.image)) {
    to_message(frame, frame_id, impl_->image);
    impl_->send(head.image, impl_->image, impl_->image.header.stamp);
  }
  if (!impl_->is_wanted(head.compressed)) return;
  to_message(frame, frame_id, impl_->compressed);
  impl_->send(head.compressed, impl_->compressed, impl_->compressed.header.stamp);
}

void ScanTopics::curbs(const CurbsSeen& seen) {
  impl_->send_found(seen, "curbs", &HeadTopics::curbs, impl_->curbs);
}

void ScanTopics::objects(const ObjectsSeen& seen) {
  impl_->send_found(seen, "objects", &HeadTopics::objects, impl_->objects);
}

void ScanTopics::status(const ScannerStatus& status) {
  if (impl_->is_wanted(impl_->diagnostics)) {
    wire::DiagnosticArray message;
    to_message(status, message);
    message.header.stamp = to_stamp(utc_now());
    impl_->send(impl_->diagnostics, message, message.header.stamp);
  }
  HeadTopics* head = impl_->find(status.head);
  if (head == nullptr) return;  // It comes before the first frame too.
  const bool has_images = head->image != kNoTopic || head->compressed != kNoTopic;
  if (!has_images) impl_->send_camera(*head, PixelGrid{}, head->last_time);
}

}  // namespace striper
