// SPDX-License-Identifier: Apache-2.0
#include "ros_writer.hpp"

#include <memory>

#include <fmt/format.h>

#include <striper/core/error.hpp>

// Names, types and user data as rmw_fastrtps and rmw_cyclonedds of Humble to Rolling make them.
namespace striper::detail {
namespace {

// "sensor_msgs/msg/LaserScan" is "sensor_msgs::msg::dds_::LaserScan_".
std::string dds_type_name(const std::string& type) {
  const std::size_t package = type.find('/');
  const std::size_t name = type.rfind('/');
  return fmt::format("{}::{}::dds_::{}_", type.substr(0, package),
                     type.substr(package + 1, name - package - 1), type.substr(name + 1));
}

DdsQos make_qos(wire::RosQos qos, const std::string& type_hash) {
  constexpr int kKept = 5;  // ROS 2's sensor data.
  const bool is_latched = qos == wire::RosQos::kLatched;
  const bool is_reliable = qos != wire::RosQos::kBestEffort;
  DdsQos made(dds_create_qos(), dds_delete_qos);
  dds_qset_history(made.get(), DDS_HISTORY_KEEP_LAST, is_latched ? 1 : kKept);
  dds_qset_reliability(made.get(),
                       is_reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(made.get(),
                      is_latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  if (type_hash.empty()) return made;
  // Iron and later read a topic's hash here; without it they complain of every topic.
  const std::string user_data = fmt::format("typehash={};", type_hash);
  dds_qset_userdata(made.get(), user_data.data(), user_data.size());
  return made;
}

dds_entity_t make_topic(const DdsParticipant& participant, const std::string& topic,
                        const wire::MessageSchema& schema) {
  ddsi_sertype* type = make_cdr_type(dds_type_name(schema.name));
  const dds_entity_t made = dds_create_topic_sertype(
      participant.handle(), dds_topic_name(topic).c_str(), &type, nullptr, nullptr, nullptr);
  if (made < 0) ddsi_sertype_unref(type);  // It is Cyclone's otherwise.
  return made;
}

}  // namespace

std::string dds_topic_name(const std::string& topic) {
  return topic.starts_with('/') ? "rt" + topic : topic;
}

RosWriter::RosWriter(const DdsParticipant& participant, const std::string& topic,
                     const wire::MessageSchema& schema, wire::RosQos qos)
    : topic_(topic),
      dds_topic_(make_topic(participant, topic, schema), "no topic " + topic),
      writer_(dds_create_writer(participant.handle(), dds_topic_.handle(),
                                make_qos(qos, schema.type_hash).get(), nullptr),
              "no writer of " + topic) {}

void RosWriter::write(CdrSample message) {
  const dds_return_t result = dds_write(writer_.handle(), &message);
  if (result == DDS_RETCODE_OK || result == DDS_RETCODE_TIMEOUT) return;
  throw Error(ErrorKind::kIo, fmt::format("{}: {}", topic_, dds_strretcode(result)));
}

}  // namespace striper::detail
