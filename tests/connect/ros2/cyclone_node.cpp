// SPDX-License-Identifier: Apache-2.0
// Stands for a ROS 2 program of one release: writes `ros_discovery_info` and prints what it hears
// there, with Cyclone DDS' own generated types.
//
//   cyclone_node humble|iron SECONDS
//
// A line of JSON each: {"ready":true}, {"participant":{gid,user_data}}, {"writer":{gid,topic}} of
// who else is there, {"node":{gid,namespace,name,readers,writers}} of what others say.
#include <chrono>
#include <cstdlib>
#include <iterator>
#include <stdexcept>
#include <string>
#include <thread>

#include <dds/dds.h>

#include "heard_lines.hpp"
#include "ros_node.h"

namespace {

using nlohmann::json;
using striper::testing::hexadecimal;
using striper::testing::print_line;

// The hash as public programs have it (zenoh-plugin-ros2dds), not our own calculator's.
constexpr const char* kUserDataOfIron =
    "typehash=RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e;";

template <typename Gids>
json gids(const Gids& sequence) {
  json list = json::array();
  for (std::uint32_t i = 0; i < sequence._length; ++i) {
    const auto& gid = sequence._buffer[i];
    list.push_back(hexadecimal(gid.data, std::size(gid.data)));
  }
  return list;
}

template <typename Info>
void print_nodes(const Info& info) {
  for (std::uint32_t i = 0; i < info.nodes._length; ++i) {
    const auto& node = info.nodes._buffer[i];
    print_line({{"node",
                 {{"gid", hexadecimal(info.gid.data, std::size(info.gid.data))},
                  {"namespace", std::string(node.node_namespace)},
                  {"name", std::string(node.node_name)},
                  {"readers", gids(node.reader_gid_seq)},
                  {"writers", gids(node.writer_gid_seq)}}}});
  }
}

std::string user_data_of(dds_qos_t* qos) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &data, &size) || data == nullptr) return {};
  std::string text(static_cast<const char*>(data), size);
  dds_free(data);
  return text;
}

// Takes all that a reader has.
template <typename Take>
void take_all(dds_entity_t reader, Take take) {
  void* sample = nullptr;
  dds_sample_info_t info{};
  while (dds_take(reader, &sample, &info, 1, 1) > 0) {
    if (info.valid_data) take(sample);
    dds_return_loan(reader, &sample, 1);
    sample = nullptr;
  }
}

void print_participant(const void* sample) {
  const auto& one = *static_cast<const dds_builtintopic_participant_t*>(sample);
  print_line({{"participant",
               {{"gid", hexadecimal(one.key.v, std::size(one.key.v))},
                {"user_data", user_data_of(one.qos)}}}});
}

void print_writer(const void* sample) {
  const auto& one = *static_cast<const dds_builtintopic_endpoint_t*>(sample);
  print_line({{"writer",
               {{"gid", hexadecimal(one.key.v, std::size(one.key.v))},
                {"topic", one.topic_name},
                {"user_data", user_data_of(one.qos)}}}});
}

template <typename Info>
int run(const dds_topic_descriptor_t& generated, const char* user_data, double seconds) {
  dds_topic_descriptor_t type = generated;
  type.m_typename = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";
  const dds_entity_t participant = dds_create_participant(DDS_DOMAIN_DEFAULT, nullptr, nullptr);
  const dds_entity_t topic =
      dds_create_topic(participant, &type, "ros_discovery_info", nullptr, nullptr);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  if (*user_data != '\0') dds_qset_userdata(qos, user_data, std::string(user_data).size());
  const dds_entity_t reader = dds_create_reader(participant, topic, qos, nullptr);
  const dds_entity_t writer = dds_create_writer(participant, topic, qos, nullptr);
  dds_delete_qos(qos);
  if (reader < 0 || writer < 0) throw std::runtime_error("no ros_discovery_info");
  const dds_entity_t participants =
      dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr);
  const dds_entity_t writers =
      dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr);
  print_line({{"ready", true}});
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
    take_all(participants, print_participant);
    take_all(writers, print_writer);
    take_all(reader, [](const void* sample) { print_nodes(*static_cast<const Info*>(sample)); });
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  dds_delete(participant);
  return 0;
}

}  // namespace

int main(int count, char** words) {
  if (count != 3) return 2;
  const double seconds = std::atof(words[2]);
  if (std::string(words[1]) == "humble") {
    return run<humble_ParticipantEntitiesInfo_>(humble_ParticipantEntitiesInfo__desc, "", seconds);
  }
  return run<iron_ParticipantEntitiesInfo_>(iron_ParticipantEntitiesInfo__desc, kUserDataOfIron,
                                            seconds);
}
