// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <striper/core/frame.hpp>
#include <striper/wire/ros_messages.hpp>

namespace striper {

/// A frame's pixels as ROS 2's image_transport compresses them: JPEG where they have 8 bits, else
/// PNG, which loses nothing. Takes some ms a megapixel. @param message used again.
/// @throws Error{kUnsupported} for an image of another type, or none.
void to_message(const Frame& frame, std::string_view frame_id, wire::CompressedImage& message);

}  // namespace striper
