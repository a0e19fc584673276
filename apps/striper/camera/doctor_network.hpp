// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <striper/capture/source_uri.hpp>
#include <striper/core/event.hpp>
#include <striper/core/frame_source.hpp>

namespace striper::program {

// What the doctor finds on the network. A build without GigE Vision finds nothing there.

/// What keeps the camera from being reached; nothing for other sources.
std::vector<Event> examine_network(const SourceUri& uri);

/// Packets lost on the way, since the source was opened.
void conclude_network(const FrameSource& source, std::vector<Event>& findings);

/// What packets the camera and this machine agreed on; 0: not known.
int packet_bytes_of(const FrameSource& source);

/// Why a camera that answers gives no frame.
std::vector<Event> examine_silence(const SourceUri& uri, int packet_bytes);

}  // namespace striper::program
