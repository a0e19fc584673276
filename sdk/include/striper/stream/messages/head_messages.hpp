// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/core/pixel_grid.hpp>
#include <striper/pipeline/scanner_status.hpp>
#include <striper/stream/scan_sink.hpp>
#include <striper/wire/ros_messages.hpp>

// What a head is, and how it is, as messages. Messages are replaced, but for their stamps, which
// are the caller's. Thread-safe on different messages.
namespace striper {

/// The camera of a model, in the frame `HEAD_camera_optical`. @param pixels where the images'
/// pixels are on the sensor: region and binning.
void to_message(const StriperModel& model, std::string_view head, const PixelGrid& pixels,
                wire::CameraInfo& message);

/// Where a head's camera and scan frames are: HEAD -> HEAD_camera_optical, HEAD -> HEAD_scanK.
void to_message(const HeadInfo& head, wire::TFMessage& message);

/// How a head's scanner stands, for `/diagnostics`: a warning where no stripe is seen or the source
/// is paused, an error where the illumination pattern was lost or no frames come.
void to_message(const ScannerStatus& status, wire::DiagnosticArray& message);

}  // namespace striper
