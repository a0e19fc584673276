// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <striper/core/stripe_axis.hpp>
#include <striper/model/laser_plane.hpp>

namespace striper::detail {

/// Why a plane has no standing scan frame.
struct ScanFrameObstacle {
  std::string value;
  std::string expected;
};

/// Finds what `standard_T_cam_scan` would refuse.
std::optional<ScanFrameObstacle> find_obstacle(const LaserPlane& plane, StripeAxis axis);

}  // namespace striper::detail
