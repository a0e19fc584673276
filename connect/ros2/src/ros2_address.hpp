// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include <striper/stream/scan_topics.hpp>
#include <striper/stream/sink_uri.hpp>

namespace striper::detail {

/// Whether the scanner is shown as a node, and to which release's programs.
enum class RosNodeChoice { kOff, kHumble, kIron, kAuto };

/// What `frames=` sends.
/// `ros2:[PREFIX][?domain=&qos=&interface=lo|NAME|auto&frames=HZ&images=&node=]`, what is not said
/// taken from the environment as ROS 2's own programs take it.
struct Ros2Address {
  std::string prefix;        ///< In front of the heads' names: words parted by '/'; may be empty.
  std::uint32_t domain = 0;  ///< domain=, else ROS_DOMAIN_ID.
  bool is_reliable = true;   ///< qos=reliable|best_effort.
  double frames_hz = 0.0;    ///< Images of each head; 0: none.
  TopicImages images = TopicImages::kNone;   ///< images=raw|compressed|both.
  RosNodeChoice node = RosNodeChoice::kOff;  ///< node=off|humble|iron|auto.
  std::string interface;                     ///< lo, a name, auto; empty: what CYCLONEDDS_URI says.
  std::string interface_from;                ///< Who said so, for people.

  /// @throws Error{kUsage} quoting what is wrong.
  static Ros2Address parse(SinkUri uri);

  /// The interface in words.
  std::string where() const;

  /// Cyclone DDS' configuration.
  std::string configuration() const;
};

/// Whether a word may be a part of a ROS 2 topic's name: letters, digits, underscores, and no digit
/// first.
bool is_ros_name(std::string_view word) noexcept;

}  // namespace striper::detail
