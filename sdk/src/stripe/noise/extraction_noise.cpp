// SPDX-License-Identifier: Apache-2.0
#include "stripe/noise/extraction_noise.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/core.hpp>

namespace striper::detail {
PlanNoise ExtractionNoise::of(const LitFrame& frame, const ProfileImages& images,
                              const std::vector<std::int32_t>& best_across,
                              const ExtractOptions& options) {
  PlanNoise noise;
  noise.speckle_contrast = options.speckle_contrast;
  if (!frame.dark.empty()) {
    noise.dark_noise_gain = static_cast<double>(frame.dark_noise_gain);
    const bool is_along_rows = options.axis == StripeAxis::kColumns;
    if (is_along_rows) noise.dark_noise_correlation = frame.dark_noise_correlation;
  }
  const double exposures =
      1.0 + noise.dark_noise_gain * BackgroundNoise::part_seen(noise.dark_noise_correlation);
  if (options.noise) {
    if (frame.full_scale_dn != full_scale_dn_) {
      const double shown_dn = background_.update(images, best_across, exposures);
      take_given(frame, shown_dn, options);
    }
    noise.model = given_;
    return noise;
  }
  const double own_dn = background_.update(images, best_across, exposures);
  noise.model.read_noise_dn = std::sqrt(std::max(0.0, own_dn * own_dn - kRounding_dn2));
  return noise;
}

// The noise that was given, in the DN of these images.
void ExtractionNoise::take_given(const LitFrame& frame, double shown_dn,
                                 const ExtractOptions& options) {
  full_scale_dn_ = frame.full_scale_dn;
  const int depth = std::bit_width(static_cast<unsigned>(frame.full_scale_dn));
  const double value_dn = cv::mean(frame.lit.row(frame.lit.rows / 2))[0];
  given_ = options.noise->at_likely_depth(depth, shown_dn * shown_dn, value_dn);
  if (options.noise->bit_depth || !given_.bit_depth) return;
  options.events.send(
      {"noise_depth_assumed",
       fmt::format("the model's noise is taken to be that of 8-bit images: these, of {} bits, "
                   "have {:.1f} DN where it says {:.1f}; noise.bit_depth in the model says which "
                   "(striper noise writes it)",
                   depth, shown_dn, std::sqrt(options.noise->variance_dn2(value_dn)))});
}

double noise_dn_of(const PlanNoise& noise) {
  return std::sqrt((1.0 + noise.dark_noise_gain) *
                   noise.model.variance_dn2(noise.model.black_level_dn));
}

}  // namespace striper::detail
