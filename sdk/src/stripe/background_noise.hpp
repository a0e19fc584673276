// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/stripe/candidates.hpp>

namespace striper::detail {

/// Follows the white noise of a stream's lit - dark from its background, DN rms with quantisation.
///
/// From the median of |x(k-2) - 2 x(k) + x(k+2)| across the stripe at scattered pixels away from
/// each line's brightest peak, and from where `variance` is 0 if that is anywhere much: ramps
/// cancel, edges are few. The first frame takes 8192 samples (1.6
/// %), later ones 384 each, averaged over about 25 frames; a jump starts anew. 3 us a frame.
class BackgroundNoise {
 public:
  /// Returns the noise, never below that of quantisation.
  double update(const LitFrame& frame, StripeAxis axis, const ChunkMaxima& peaks);

 private:
  template <typename Pixel>
  double measure(const LitFrame& frame, StripeAxis axis, const ChunkMaxima& peaks, int samples);

  template <typename Pixel>
  std::uint32_t sample(const LitFrame& frame, StripeAxis axis, const ChunkMaxima& peaks,
                       int samples, bool only_clean);

  std::vector<std::uint32_t> histogram_;
  std::uint64_t next_ = 0;  // Frames look at different pixels.
  double sigma_dn_ = 0.0;   // 0: not known yet.
};

}  // namespace striper::detail
