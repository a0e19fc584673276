// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <striper/capture/camera_listing.hpp>

namespace striper {

/// Lists every node of the system that captures frames through V4L2, in the order of their
/// numbers.
///
/// Asks only, sets nothing: cameras that others stream from may be listed too. A node without
/// permission is listed with `trouble` and nothing else.
std::vector<CameraListing> list_v4l2_cameras();

/// The same for one node. @throws Error as `open_v4l2` does where it is no camera.
CameraListing describe_v4l2_camera(const std::string& path);

}  // namespace striper
