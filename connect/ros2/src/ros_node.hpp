// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <striper/wire/ros_node_messages.hpp>

#include "dds_domain.hpp"
#include "ros_graph.hpp"
#include "ros_writer.hpp"

namespace striper::detail {

/// The DDS topic on which ROS 2's programs say which node has which topics.
inline constexpr const char* kNodeTopic = "ros_discovery_info";

/// How identifiers look to the ROS 2 programs of a domain, by who writes `ros_discovery_info`
/// there. Those of Iron and later give the topic's hash, those of Humble know none.
enum class RosRelease { kNone, kHumble, kIron, kBoth };

/// A node and the topics that it writes.
struct RosNodeEntry {
  std::string name_space;  ///< "/" or "/truck".
  std::string name;
  std::vector<dds_guid_t> writers;
};

/// Tells ROS 2's programs which node has which topics, so that `ros2 node list` shows it. Without
/// it topics are found all the same.
///
/// A message of the wrong size ends Humble's programs, so with `auto` nothing is said before a
/// program was heard for kSettles, and nothing any more where both sizes are. Programs of a domain
/// are discovered one after another, within about a second.
class RosNodeAnnouncer {
 public:
  RosNodeAnnouncer(const DdsParticipant& participant, RosNodeChoice choice);

  /// Another program's writer.
  void hear(const RosEndpoint& writer);

  /// Whether what was heard makes another announcement of the same nodes necessary.
  bool is_due() const noexcept;

  /// Says which nodes this program has, where it may, and keeps saying it to who comes later.
  /// @return the release that it is said to, where that is not what it was at the last call.
  std::optional<RosRelease> announce(const std::vector<RosNodeEntry>& nodes);

 private:
  template <std::size_t GidBytes>
  void write(const std::vector<RosNodeEntry>& nodes);
  void choose_writer(RosRelease release);
  RosRelease release() const noexcept;

  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kSettles{2};

  const DdsParticipant& participant_;
  RosNodeChoice choice_;
  RosRelease heard_ = RosRelease::kNone;
  Clock::time_point first_heard_;
  RosRelease said_to_ = RosRelease::kNone;
  std::optional<RosWriter> writer_;
};

}  // namespace striper::detail
