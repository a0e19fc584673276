// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <opencv2/core/types.hpp>

#include <striper/core/pixel_grid.hpp>
#include <striper/gige/gige_options.hpp>

#include "gige/pictures/pixel_layout.hpp"
#include "gige/protocol/feature_access.hpp"

namespace striper::detail {

/// What the camera gives once it is set up, read back from it.
struct FrameSetup {
  const PixelLayout* layout = nullptr;
  cv::Size size;
  cv::Size sensor_size;
  PixelGrid grid;
  std::int64_t exposure_ns = 0;  ///< 0 if unknown.
  double rate_hz = 0.0;          ///< 0 if unknown.
};

/// Writes everything that the options ask for and reads it back: image, light, rate, features.
/// @throws Error quoting the feature, the value and what is allowed.
FrameSetup set_up_frames(const FeatureAccess& features, const GigeOptions& options);

/// Sets a fixed exposure, or gain in the camera's unit (dB but for GainRaw); automatic modes go
/// off.
void set_exposure(const FeatureAccess& features, double exposure_us);
void set_gain(const FeatureAccess& features, double gain);

/// Has each frame bring what the encoder shows, where the options ask for it.
/// @return the feature that holds it, static; null where it is not asked for.
/// @throws Error{kUnsupported} naming the chunks that the camera has.
const char* enable_encoder_chunk(const FeatureAccess& features, const GigeOptions& options);

/// Free-running, or triggered by what the options name. @param by_host each frame is triggered by
/// software.
void set_up_trigger(const FeatureAccess& features, const GigeOptions& options, bool by_host);

/// Packet size and delay, heartbeat. @return the packet size that is in force, bytes.
int set_up_transport(ArvCamera* camera, const FeatureAccess& features, const GigeOptions& options);

}  // namespace striper::detail
