// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace striper::detail {

/// How probable each of several models is by what was measured: their likelihoods, those of long
/// ago counting less. The models are equally probable beforehand.
///
/// No allocation. Source: P. D. Hanlon and P. S. Maybeck, *Multiple-model adaptive estimation using
/// a residual correlation Kalman filter bank*, 2000, section II; that likelihoods fade is what lets
/// the best model change.
template <std::size_t kModels>
class ModelWeights {
 public:
  /// Lets what was measured so far count by `share` of what it does, 0 to 1.
  void fade(double share) noexcept {
    for (double& one : log_likelihood_) one *= share;
  }

  /// Takes what a model made of a measurement. @param most of a square: an accident says nothing.
  void add(std::size_t model, double square, double variance, double most = 9.0) noexcept {
    log_likelihood_[model] -= 0.5 * (std::min(square, most) + std::log(variance));
  }

  /// Their probabilities; the sum is 1.
  std::array<double, kModels> weights() const noexcept {
    const double best = *std::max_element(log_likelihood_.begin(), log_likelihood_.end());
    std::array<double, kModels> shares;
    double sum = 0.0;
    for (std::size_t i = 0; i < kModels; ++i) {
      sum += shares[i] = std::exp(log_likelihood_[i] - best);
    }
    for (double& share : shares) share /= sum;
    return shares;
  }

 private:
  std::array<double, kModels> log_likelihood_{};
};

}  // namespace striper::detail
