// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string_view>

#include <striper/core/event.hpp>
#include <striper/core/frame_source.hpp>

namespace striper {

/// Opens a source of frames by its address:
///
///     images:DIR-or-GLOB?fps=30        image files of a directory or pattern, in natural order
///     mcap:run.mcap?head=H&realtime=yes   the frames of a recording
///     sim:scene.yaml                   the simulated striper
///     v4l2:/dev/video0?standard=ntsc   a V4L2 camera or grabber
///     gige:SERIAL-or-IP                a GigE Vision camera
///     PATH                             whichever of these the path is
///
/// Every source knows `laser=` (the pattern, see IlluminationPattern) and
/// `fields=split-top|split-bottom` (its frames are two fields, the named one first in time).
/// Documentation of the other keys is with each source's header.
///
/// @throws Error{kUsage} for a wrong address, Error{kNotFound} where there is nothing there,
///         Error{kUnsupported} where this build lacks the backend, Error{kDevice} where a device
///         refuses.
/// @param events hears what the source has to say, now and while it streams.
std::unique_ptr<FrameSource> open_source(std::string_view uri, const EventPort& events = {});

}  // namespace striper
