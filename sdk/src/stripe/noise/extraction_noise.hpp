// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <striper/core/lit_frame.hpp>
#include <striper/core/noise_model.hpp>
#include <striper/stripe/extractor.hpp>

#include "stripe/noise/background_noise.hpp"
#include "stripe/profile/profile_kernel.hpp"
#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {

/// The noise of each frame of a stream: as it was given, or as the background shows it.
class ExtractionNoise {
 public:
  /// @param best_across the brightest pixel of each scan line: no background.
  PlanNoise of(const LitFrame& frame, const ProfileImages& images,
               const std::vector<std::int32_t>& best_across, const ExtractOptions& options);

 private:
  void take_given(const LitFrame& frame, double shown_dn, const ExtractOptions& options);

  BackgroundNoise background_;
  NoiseModel given_;  // In the DN of images of this full scale.
  int full_scale_dn_ = 0;
};

/// Of a dark pixel, lit minus dark where that is subtracted.
double noise_dn_of(const PlanNoise& noise);

}  // namespace striper::detail
