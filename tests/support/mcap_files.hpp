// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <striper/wire/mcap_reader.hpp>
#include <striper/wire/mcap_writer.hpp>

#include "support/random.hpp"

namespace striper::testing {

/// A message with its own bytes.
struct KeptMessage {
  std::string topic;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::vector<std::uint8_t> data;
  friend bool operator==(const KeptMessage&, const KeptMessage&) = default;
};

/// What a file holds, and how its reading ended.
struct McapContent {
  std::vector<KeptMessage> messages;
  wire::McapEnd end = wire::McapEnd::kUnread;
};

/// Reads a whole file: messages, attachments.
inline McapContent read_mcap(const std::filesystem::path& path,
                             const wire::McapReaderOptions& options = {}) {
  McapContent content;
  wire::McapReader reader(path, options);
  for (std::size_t i = 0; i < reader.attachments().size(); ++i) reader.read_attachment(i);
  for (wire::McapMessage message; reader.next(message);) {
    content.messages.push_back({reader.channels().at(message.channel).topic,
                                message.sequence,
                                message.log_time_ns,
                                message.publish_time_ns,
                                {message.data.begin(), message.data.end()}});
  }
  content.end = reader.end();
  return content;
}

/// Writes `count` messages of two topics with random data, half of it compressible, every 10 ms; an
/// attachment and metadata in front.
inline std::vector<KeptMessage> write_mcap(const std::filesystem::path& path, int count,
                                           std::size_t max_bytes,
                                           const wire::McapWriterOptions& options = {}) {
  wire::McapWriter writer(path, options);
  writer.attach({"head/striper.yaml", "application/yaml", 5, 6, "striper_model: 1\n"});
  writer.add_metadata({"striper", {{"version", "1"}, {"frame_info", "1"}}});
  const std::vector<std::string> topics = {"/striper/polar_scan", "/striper/events"};
  const std::uint16_t first =
      writer.add_channel(ros_channel(topics[0], wire::schema_of<wire::PolarScan>()));
  writer.add_channel(ros_channel(topics[1], wire::schema_of<wire::Event>()));
  std::vector<KeptMessage> kept;
  for (int i = 0; i < count; ++i) {
    const auto size = static_cast<std::size_t>(uniform(0.0, static_cast<double>(max_bytes)));
    KeptMessage message{
        topics[i % 2], static_cast<std::uint32_t>(i / 2), 1'000'000'000U + 10'000'000U * i, 7U, {}};
    message.data.assign(size, static_cast<std::uint8_t>(i));
    for (std::size_t byte = 0; byte < size / 2; ++byte)
      message.data[byte] = static_cast<std::uint8_t>(random_generator()());
    writer.write({static_cast<std::uint16_t>(first + i % 2), message.sequence, message.log_time_ns,
                  message.publish_time_ns, message.data});
    kept.push_back(std::move(message));
  }
  writer.close();
  return kept;
}

}  // namespace striper::testing
