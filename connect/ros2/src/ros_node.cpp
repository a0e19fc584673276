// SPDX-License-Identifier: Apache-2.0
#include "ros_node.hpp"

#include <algorithm>
#include <iterator>

#include <striper/wire/cdr.hpp>

namespace striper::detail {
namespace {

using wire::kGidBytesOfHumble;
using wire::kGidBytesOfIron;

template <std::size_t Bytes>
wire::Gid<Bytes> gid_of(const dds_guid_t& guid) {
  wire::Gid<Bytes> gid;
  std::copy(std::begin(guid.v), std::end(guid.v), gid.data.begin());
  return gid;
}

template <std::size_t Bytes>
wire::NodeEntitiesInfo<Bytes> info_of(const RosNodeEntry& node) {
  wire::NodeEntitiesInfo<Bytes> info;
  info.node_namespace.assign(node.name_space);
  info.node_name.assign(node.name);
  for (const dds_guid_t& writer : node.writers) {
    info.writer_gid_seq.push_back(gid_of<Bytes>(writer));
  }
  return info;
}

// Humble's programs give their topics no hash.
wire::MessageSchema schema_for(RosRelease release) {
  if (release == RosRelease::kIron) {
    return wire::schema_of<wire::ParticipantEntitiesInfo<kGidBytesOfIron>>();
  }
  wire::MessageSchema schema = wire::schema_of<wire::ParticipantEntitiesInfo<kGidBytesOfHumble>>();
  schema.type_hash.clear();
  return schema;
}

}  // namespace

RosNodeAnnouncer::RosNodeAnnouncer(const DdsParticipant& participant, RosNodeChoice choice)
    : participant_(participant), choice_(choice) {
  if (choice != RosNodeChoice::kOff) participant.claim_enclave();
}

void RosNodeAnnouncer::hear(const RosEndpoint& writer) {
  if (writer.topic != kNodeTopic) return;
  const bool has_hash = writer.user_data.find("typehash=") != std::string::npos;
  const RosRelease release = has_hash ? RosRelease::kIron : RosRelease::kHumble;
  if (heard_ == RosRelease::kNone) {
    heard_ = release;
    first_heard_ = Clock::now();
  }
  if (heard_ != release) heard_ = RosRelease::kBoth;
}

RosRelease RosNodeAnnouncer::release() const noexcept {
  switch (choice_) {
    case RosNodeChoice::kOff:
      return RosRelease::kNone;
    case RosNodeChoice::kHumble:
      return RosRelease::kHumble;
    case RosNodeChoice::kIron:
      return RosRelease::kIron;
    case RosNodeChoice::kAuto:
      break;
  }
  const bool is_settled = heard_ == RosRelease::kBoth || Clock::now() - first_heard_ >= kSettles;
  return is_settled ? heard_ : said_to_;
}

bool RosNodeAnnouncer::is_due() const noexcept { return release() != said_to_; }

std::optional<RosRelease> RosNodeAnnouncer::announce(const std::vector<RosNodeEntry>& nodes) {
  const RosRelease release = this->release();
  const bool is_new = release != said_to_;
  if (is_new) choose_writer(release);
  if (release == RosRelease::kHumble) write<kGidBytesOfHumble>(nodes);
  if (release == RosRelease::kIron) write<kGidBytesOfIron>(nodes);
  return is_new ? std::optional(release) : std::nullopt;
}

void RosNodeAnnouncer::choose_writer(RosRelease release) {
  writer_.reset();
  said_to_ = release;
  if (release == RosRelease::kNone || release == RosRelease::kBoth) return;
  writer_.emplace(participant_, kNodeTopic, schema_for(release), wire::RosQos::kLatched);
}

template <std::size_t GidBytes>
void RosNodeAnnouncer::write(const std::vector<RosNodeEntry>& nodes) {
  wire::ParticipantEntitiesInfo<GidBytes> message;
  message.gid = gid_of<GidBytes>(participant_.guid());
  std::transform(nodes.begin(), nodes.end(), std::back_inserter(message.node_entities_info_seq),
                 [](const RosNodeEntry& node) { return info_of<GidBytes>(node); });
  std::vector<std::uint8_t> bytes;
  wire::write_cdr(message, bytes);
  writer_->write(bytes);
}

}  // namespace striper::detail
