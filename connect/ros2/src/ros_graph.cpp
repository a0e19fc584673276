// SPDX-License-Identifier: Apache-2.0
#include "ros_graph.hpp"

#include <algorithm>
#include <array>
#include <iterator>

namespace striper::detail {
namespace {

dds_entity_t make_reader(const DdsParticipant& participant, RosGraph::Side side) {
  const dds_entity_t topic = side == RosGraph::Side::kWriters ? DDS_BUILTIN_TOPIC_DCPSPUBLICATION
                                                              : DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION;
  return dds_create_reader(participant.handle(), topic, nullptr, nullptr);
}

std::string user_data(const dds_builtintopic_endpoint_t& endpoint) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(endpoint.qos, &data, &size) || data == nullptr) return {};
  std::string text(static_cast<const char*>(data), size);
  dds_free(data);
  return text;
}

bool is_same(const dds_guid_t& a, const dds_guid_t& b) {
  return std::equal(std::begin(a.v), std::end(a.v), std::begin(b.v));
}

}  // namespace

RosGraph::RosGraph(const DdsParticipant& participant, Side side)
    : own_(participant.guid()), reader_(make_reader(participant, side), "no list of topics") {}

std::vector<RosEndpoint> RosGraph::take_new() {
  constexpr int kAtOnce = 16;
  std::vector<RosEndpoint> found;
  std::array<dds_sample_info_t, kAtOnce> infos{};
  int taken = kAtOnce;
  while (taken == kAtOnce) {
    std::array<void*, kAtOnce> samples{};  // Cyclone's own memory, lent.
    taken = dds_take(reader_.handle(), samples.data(), infos.data(), kAtOnce, kAtOnce);
    for (int i = 0; i < taken; ++i) {
      const auto& one = *static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
      if (!infos[i].valid_data || is_same(one.participant_key, own_)) continue;
      found.push_back({one.topic_name, one.type_name, user_data(one), one.participant_key});
    }
    if (taken > 0) dds_return_loan(reader_.handle(), samples.data(), taken);
  }
  return found;
}

}  // namespace striper::detail
