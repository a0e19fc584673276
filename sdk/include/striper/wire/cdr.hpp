// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <striper/wire/ros_messages.hpp>
#include <striper/wire/ros_node_messages.hpp>
#include <striper/wire/striper_messages.hpp>

namespace striper::wire {

/// What other programs need to read a type of message.
struct MessageSchema {
  std::string name;       ///< "sensor_msgs/msg/LaserScan".
  std::string text;       ///< ROS 2's .msg text, the types that it uses behind it.
  std::string type_hash;  ///< "RIHS01_" and 64 hexadecimal digits: ROS 2's hash of the fields'
                          ///< names and types.
};

/// The schema of a message, made from the same list of fields as its bytes. Thread-safe; made once.
/// Source of the hash: ROS 2, package rosidl_generator_type_description.
/// M: PointCloud2, LaserScan, Image, CompressedImage, CameraInfo, TFMessage, DiagnosticArray,
/// ParticipantEntitiesInfo of both sizes, PolarScan, FrameInfo, Odometer, Event, Curbs, Objects;
/// Header and PointField as well.
template <typename M>
const MessageSchema& schema_of();

/// Writes a message as CDR: OMG's XCDR version 1, little endian, 4 bytes of encapsulation first, as
/// ROS 2 does.
/// @param out replaced; what it has reserved is used again, so that a stream allocates nothing.
template <typename M>
void write_cdr(const M& message, std::vector<std::uint8_t>& out);

/// Reads what `write_cdr` or another ROS 2 program wrote, of either byte order.
/// @param message replaced; its memory is used again. Never takes more memory than a small multiple
/// of the bytes.
/// @throws Error naming type, field and byte: kBadFile where the bytes are too few, too many or no
/// such message,
///         kUnsupported for another encapsulation. `message` may then be half of what was there.
template <typename M>
void read_cdr(std::span<const std::uint8_t> bytes, M& message);

}  // namespace striper::wire
