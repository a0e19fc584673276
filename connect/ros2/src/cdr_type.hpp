// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <dds/ddsi/ddsi_sertype.h>

namespace striper::detail {

/// What `dds_write` is given of a type made by `make_cdr_type`: a message as `write_cdr` makes it,
/// its 4 bytes of encapsulation first.
using CdrSample = std::span<const std::uint8_t>;

/// A type of Cyclone DDS whose samples are bytes already, so that there is one description of every
/// message (sdk/wire). For writers alone: nothing here reads. It carries no type information, as
/// ROS 2's writers carry none; with it Fast DDS would not match.
/// @param name "sensor_msgs::msg::dds_::LaserScan_". Who gets it owns a reference.
ddsi_sertype* make_cdr_type(const std::string& name);

}  // namespace striper::detail
