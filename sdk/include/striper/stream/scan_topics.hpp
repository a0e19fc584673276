// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <striper/stream/scan_sink.hpp>
#include <striper/wire/cdr.hpp>
#include <striper/wire/mcap_records.hpp>

namespace striper {

/// Where topics go: DDS, a WebSocket. Called from one thread.
class TopicPort {
 public:
  TopicPort() = default;
  TopicPort(const TopicPort&) = delete;
  TopicPort& operator=(const TopicPort&) = delete;
  virtual ~TopicPort() = default;

  /// Offers a topic. @param topic "/striper/points". @return its number, for what follows.
  virtual int offer(const std::string& topic, const wire::MessageSchema& schema,
                    wire::RosQos qos) = 0;
  /// Whether anybody wants it just now: nothing is made that nobody wants. Latched topics are.
  virtual bool is_wanted(int /*topic*/) const { return true; }
  /// @param cdr valid until it returns. @param time_ns since 1970 where the source has a clock.
  virtual void send(int topic, std::span<const std::uint8_t> cdr, std::int64_t time_ns) = 0;
};

/// How frames are given: as they are, as JPEG or PNG (`image_raw/compressed`), or both.
enum class TopicImages { kNone, kRaw, kCompressed, kBoth };

/// `raw`, `compressed` or `both`; empty for any other word.
std::optional<TopicImages> topic_images_from_string(std::string_view word) noexcept;

/// Scans, images and how heads are as ROS 2's messages, each topic to a TopicPort: for each head
/// `points`, `scan`, `camera_info` (once a second, or with each image), `image_raw`,
/// `image_raw/compressed`; where they are wanted `polar_scan` and, beside each image, `frame_info`;
/// of all heads `/tf_static` and `/diagnostics`. What a sink does with them, call by call as
/// ScanSink says. No allocation in steady state but what the port makes.
class ScanTopics {
 public:
  struct Options {
    std::string prefix;  ///< In front of the heads' names: "/truck"; may be empty.
    wire::RosQos qos = wire::RosQos::kReliable;  ///< Of what streams.
    TopicImages images = TopicImages::kNone;
    bool has_own_messages = false;  ///< striper_msgs too, of which ROS 2 has no package.
  };

  /// @param port outlives it.
  ScanTopics(TopicPort& port, Options options);
  ~ScanTopics();

  void open(const HeadInfo& head);
  void write(const PolarScan& scan);
  void write(const Frame& frame);
  void status(const ScannerStatus& status);
  /// As `curbs` and `objects` of their head, topics that are offered with the first of them.
  void curbs(const CurbsSeen& seen);
  void objects(const ObjectsSeen& seen);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
