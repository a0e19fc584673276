// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <striper/core/event.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/illumination_pattern.hpp>
#include <striper/wire/ros_messages.hpp>
#include <striper/wire/striper_messages.hpp>

// Frames and events as messages. Messages are used again, so that a stream allocates nothing but
// where texts grow.
namespace striper {

/// What a frame has beside its pixels. @param pattern the source's.
void to_message(const Frame& frame, const IlluminationPattern& pattern, wire::FrameInfo& message);

/// A frame's pixels, lossless: mono8, mono16, bgr8 or bgr16, rows one after another.
/// @throws Error{kUnsupported} for an image of another type, or none.
void to_message(const Frame& frame, std::string_view frame_id, wire::Image& message);

/// The inverse of the first: all of a frame but its image. @throws Error{kBadFile} where a number
/// stands for nothing.
void from_message(const wire::FrameInfo& message, Frame& frame, IlluminationPattern& pattern);

/// The inverse of the second, and anybody's Image: mono8, mono16, bgr8, bgr16, rgb8, rgb16 with any
/// step and byte order. `frame.image` is new; `frame.bit_depth` is left as it is. @throws
/// Error{kUnsupported} for another encoding, {kBadFile} where there are too few bytes.
void from_message(const wire::Image& message, Frame& frame);

/// An event, its time to the nanosecond. @param message replaced.
void to_message(const Event& event, wire::Event& message);

/// The inverse. @throws Error{kBadFile} for a code or severity that this version does not know.
Event event_from_message(const wire::Event& message);

}  // namespace striper
