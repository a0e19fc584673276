// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <striper/wire/cdr.hpp>
#include <striper/wire/mcap_records.hpp>

#include "cdr_type.hpp"
#include "dds_domain.hpp"

namespace striper::detail {

/// A ROS 2 topic that this process writes.
class RosWriter {
 public:
  /// @param topic "/striper/points". @throws Error{kIo} where another type has its name here.
  RosWriter(const DdsParticipant& participant, const std::string& topic,
            const wire::MessageSchema& schema, wire::RosQos qos);

  const std::string& topic() const noexcept { return topic_; }
  dds_guid_t guid() const { return writer_.guid(); }

  /// Writes a message as `wire::write_cdr` makes it. Never waits. @throws Error{kIo} where Cyclone
  /// DDS is at its end.
  void write(CdrSample message);

 private:
  std::string topic_;
  DdsEntity dds_topic_;
  DdsEntity writer_;
};

/// A topic's name in DDS: "rt/striper/points"; what begins with no '/' is none of ROS' topics.
std::string dds_topic_name(const std::string& topic);

}  // namespace striper::detail
