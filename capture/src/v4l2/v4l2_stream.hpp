// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <striper/capture/camera_listing.hpp>
#include <striper/v4l2/v4l2_source.hpp>

#include "v4l2/device/video_calls.hpp"

namespace striper::detail::v4l2 {

/// `open_v4l2` through given system calls: for tests with a device of their own.
std::unique_ptr<FrameSource> open(const V4l2Options& options, std::shared_ptr<VideoCalls> calls);

/// `describe_v4l2_camera` through given system calls.
CameraListing describe(const std::string& path, std::shared_ptr<VideoCalls> calls);

}  // namespace striper::detail::v4l2
