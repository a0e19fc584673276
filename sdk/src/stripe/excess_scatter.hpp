// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <striper/stripe/stripe.hpp>

namespace striper::detail {

/// Learns how much the stripe scatters along itself beyond what the noise of the pixels explains:
/// speckle, the texture of surfaces, what a picture's compression does.
///
/// From fourth differences of good returns three lines apart, which no straight or gently bent
/// surface shows, and their median, which edges do not move. Two standard errors of the median are
/// given to chance. The first frame takes 384 samples, later ones 128 each, averaged over about 24
/// frames. Less than 1 us a frame where there is no excess, 3 us where there is.
class ExcessScatter {
 public:
  /// The excess as it stands, pixels.
  double sigma_px() const noexcept { return sigma_px_; }

  /// Looks at a frame whose `sigma_px` holds the noise of the pixels alone. Pixels as in `stripe`.
  void update(const Stripe& stripe);

 private:
  struct Difference {
    double squared;
    double variance;
  };
  void take_differences(const Stripe& stripe, std::size_t most);
  bool is_explained(double allowed) const;
  double median_ratio(double excess2);
  double solve(double allowed);

  std::vector<Difference> differences_;
  std::vector<double> scratch_;
  double sigma_px_ = 0.0;
  double excess2_ = 0.0;
  double weight_ = 0.0;  // Of past frames, in samples.
  std::size_t first_ = 0;
};

}  // namespace striper::detail
