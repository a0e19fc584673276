// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <vector>

#include <striper/core/event.hpp>

#include "ros2_address.hpp"

namespace striper::detail {

/// What keeps ROS 2 programs from hearing the topics of an address, and what is heard there: the
/// interface, multicast on it, other domains, other users' shared memory, names that are taken.
/// @param watch how long to listen to the domain.
std::vector<Event> examine_ros2(const Ros2Address& address, std::chrono::milliseconds watch);

}  // namespace striper::detail
