// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <striper/stream/scan_sink.hpp>

#include "ros2_address.hpp"

namespace striper::detail {

/// Scans as ROS 2 topics: for each head `points`, `scan`, `camera_info` (once a second, or with
/// each image), `image_raw` where it is asked for; of all heads `/tf_static` and `/diagnostics`.
std::unique_ptr<ScanSink> make_ros2_sink(const Ros2Address& address);

}  // namespace striper::detail
