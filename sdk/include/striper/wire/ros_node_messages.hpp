// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

// How ROS 2's programs tell each other which node has which topics: package rmw_dds_common. Their
// identifiers have 24 bytes in Humble and 16 in Iron and later; a message of the other size ends
// Humble's programs (rmw_fastrtps #733).
namespace striper::wire {

inline constexpr std::size_t kGidBytesOfHumble = 24;
inline constexpr std::size_t kGidBytesOfIron = 16;

/// A text of at most N bytes.
template <std::size_t N>
struct BoundedString : std::string {
  using std::string::string;
};

/// rmw_dds_common/msg/Gid: the GUID of a program, writer or reader, zeros behind its 16 bytes.
template <std::size_t Bytes>
struct Gid {
  std::array<std::uint8_t, Bytes> data{};
};

/// rmw_dds_common/msg/NodeEntitiesInfo.
template <std::size_t GidBytes>
struct NodeEntitiesInfo {
  BoundedString<256> node_namespace;  ///< "/" or "/truck".
  BoundedString<256> node_name;
  std::vector<Gid<GidBytes>> reader_gid_seq;
  std::vector<Gid<GidBytes>> writer_gid_seq;
};

/// rmw_dds_common/msg/ParticipantEntitiesInfo, on the DDS topic `ros_discovery_info`.
template <std::size_t GidBytes>
struct ParticipantEntitiesInfo {
  Gid<GidBytes> gid;
  std::vector<NodeEntitiesInfo<GidBytes>> node_entities_info_seq;
};

}  // namespace striper::wire
