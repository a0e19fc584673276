// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "stripe/profile/profile_kernel.hpp"

namespace striper::detail {

/// Follows the white noise of a stream's exposures from the background of lit - dark, DN rms with
/// quantisation.
///
/// From the median of |x(k-2) - 2 x(k) + x(k+2)| across the stripe at scattered pixels away from
/// each scan line's brightest peak, and from where `variance` is 0 if that is anywhere much: ramps
/// cancel, edges are few. The first frame takes 8192 samples (1.6 %), every second later one 192,
/// averaged over about 25 of those; a jump starts anew. A quarter of a microsecond a frame.
class BackgroundNoise {
 public:
  /// Returns the noise of one exposure, never below that of quantisation.
  /// @param peaks of each scan line, where its brightest peak is. @param exposures how many
  /// exposures' variance lit - dark shows here: what is tracked does not jump with what is
  /// subtracted.
  double update(const ProfileImages& images, const std::vector<std::int32_t>& peaks,
                double exposures);

  /// How much of the variance of a noise with these correlations of pixels one, two and three apart
  /// the differences show: all of it where there are none.
  static double part_seen(const std::array<float, 3>& correlation) noexcept;

 private:
  template <typename Pixel>
  double measure(const ProfileImages& images, const std::vector<std::int32_t>& peaks, int samples);
  template <typename Pixel>
  void sample(const ProfileImages& images, const std::vector<std::int32_t>& peaks, int samples,
              bool only_clean);
  template <typename Pixel>
  void count_run(const ProfileImages& images, const std::int32_t* peaks, int line, int across,
                 int count, bool only_clean);

  std::vector<std::uint32_t> histogram_;  // Of the absolute differences.
  std::uint32_t total_ = 0;
  std::uint64_t next_ = 0;  // Frames look at different pixels.
  unsigned frames_ = 0;
  double sigma_dn_ = 0.0;  // 0: not known yet.
};

}  // namespace striper::detail
