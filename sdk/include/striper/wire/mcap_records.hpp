// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <striper/wire/cdr.hpp>

// What an MCAP file holds (https://mcap.dev/spec, version 0): channels of messages, attachments,
// metadata. Times are nanoseconds since 1970, or since the first frame where the source has no
// clock.
namespace striper::wire {

/// How messages are read.
struct McapSchema {
  std::string name;      ///< "sensor_msgs/msg/LaserScan".
  std::string encoding;  ///< "ros2msg"; empty: there is no schema.
  std::string data;
  friend bool operator==(const McapSchema&, const McapSchema&) = default;
};

/// Messages of one topic and one schema.
struct McapChannel {
  std::string topic;
  std::string message_encoding;  ///< "cdr".
  McapSchema schema;
  std::map<std::string, std::string> metadata;
  friend bool operator==(const McapChannel&, const McapChannel&) = default;
};

/// A message; `data` belongs to whoever made it.
struct McapMessage {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::span<const std::uint8_t> data;
};

/// A file within the file: a model.
struct McapAttachment {
  std::string name;
  std::string media_type;
  std::uint64_t log_time_ns = 0;
  std::uint64_t create_time_ns = 0;
  std::string data;
};

/// Words about the file.
struct McapMetadata {
  std::string name;
  std::map<std::string, std::string> values;
};

/// Counts over a whole file.
struct McapStatistics {
  std::uint64_t messages = 0;
  std::uint16_t schemas = 0;
  std::uint32_t channels = 0;
  std::uint32_t attachments = 0;
  std::uint32_t metadata = 0;
  std::uint32_t chunks = 0;
  std::uint64_t start_ns = 0;  ///< Least and greatest log time; 0 without messages.
  std::uint64_t end_ns = 0;
  std::map<std::uint16_t, std::uint64_t> channel_messages;
};

enum class McapCompression { kNone, kZstd, kLz4 };

/// Whether this build can write and read it (none: always; zstd and lz4: where their libraries were
/// found).
bool has_compression(McapCompression compression) noexcept;

/// How a topic was offered to readers; `ros2 bag play` offers it so again.
enum class RosQos {
  kReliable,    ///< Keep the last 5, reliable.
  kBestEffort,  ///< Keep the last 5, best effort.
  kLatched,     ///< Reliable, the last one kept for readers that come later: /tf_static.
};

/// A channel as rosbag2 writes it: CDR, the schema's text, quality of service and hash in the
/// metadata.
McapChannel ros_channel(const std::string& topic, const MessageSchema& schema,
                        RosQos qos = RosQos::kReliable);

}  // namespace striper::wire
