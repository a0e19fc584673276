// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <striper/capture/camera_listing.hpp>

namespace striper {

/// Lists every camera that this build can open, whichever way it is connected.
///
/// Takes as long as a network search does (about a second) where GigE Vision is built in. Asks
/// only, sets nothing. What cannot be reached is left out; what may not be opened is listed with
/// `trouble`.
std::vector<CameraListing> list_cameras();

}  // namespace striper
