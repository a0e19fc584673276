// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <striper/stripe/stripe.hpp>

namespace striper::detail {

/// Learns how much the stripe scatters along itself beyond what the noise of the pixels explains:
/// speckle, the texture of surfaces, what an image's compression does.
///
/// From fourth differences of good returns two scan lines apart, which no straight or gently bent
/// surface shows, and their median without what stands out by 4 standard deviations: edges. Over
/// the last 1536 of them: 384 of each of the first frames, 16 of each later one. Two standard
/// errors of the median may be chance, so that noise alone is no excess; what is plainly more
/// counts in full. A third of a microsecond a frame, 2 us among many edges.
class ExcessScatter {
 public:
  /// The excess as it stands, pixels.
  double sigma_px() const noexcept { return sigma_px_; }

  /// Looks at a frame whose `sigma_px` holds the noise of the pixels alone. Pixels as in `stripe`.
  void update(const Stripe& stripe);

 private:
  struct Difference {
    float squared;
    float variance;
  };
  void take_differences(const Stripe& stripe, std::size_t most);
  void keep(const Difference& difference);
  bool is_explained(double allowed) const;
  double leave_out_edges();
  double median_ratio(double excess2);
  double solve(double chance);

  std::vector<Difference> differences_;  // The oldest one is at next_ once all places are taken.
  std::size_t next_ = 0;
  std::vector<Difference> core_;  // Without edges.
  std::vector<float> scratch_;
  std::size_t frames_ = 0;
  double sigma_px_ = 0.0;
};

}  // namespace striper::detail
