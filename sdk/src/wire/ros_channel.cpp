// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <striper/wire/mcap_records.hpp>

namespace striper::wire {

// The form that rosbag2 of Humble and Jazzy reads where a file has no "rosbag2" metadata: numbers,
// not words (rmw/types.h: reliable 1, best effort 2; transient local 1, volatile 2; the duration is
// "infinite").
McapChannel ros_channel(const std::string& topic, const MessageSchema& schema, RosQos qos) {
  constexpr std::string_view kForever = "    sec: 9223372036\n    nsec: 854775807\n";
  const std::string profile = fmt::format(
      "- history: 1\n  depth: {}\n  reliability: {}\n  durability: {}\n  deadline:\n{}  "
      "lifespan:\n{}  liveliness: 1\n"
      "  liveliness_lease_duration:\n{}  avoid_ros_namespace_conventions: false",
      qos == RosQos::kLatched ? 1 : 5, qos == RosQos::kBestEffort ? 2 : 1,
      qos == RosQos::kLatched ? 1 : 2, kForever, kForever, kForever);
  return {topic,
          "cdr",
          {schema.name, "ros2msg", schema.text},
          {{"offered_qos_profiles", profile}, {"topic_type_hash", schema.type_hash}}};
}

}  // namespace striper::wire
