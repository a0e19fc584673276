// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace striper::detail {

/// What a filter response of so many standard deviations says about a scan line of `length`
/// independent pixels of pure noise.
class Detection {
 public:
  /// Tables for scan lines of this length; no work when it has not changed.
  void prepare(int length, double false_alarm_rate, double weak_false_alarm_rate);

  /// Noise exceeds it in `false_alarm_rate` of the scan lines: Phi^-1((1 - rate)^(1 / length)).
  double threshold() const noexcept { return threshold_; }
  double weak_threshold() const noexcept { return weak_threshold_; }

  /// The probability that noise alone stays below a response in the whole scan line, as a table:
  /// kPerSigma entries to a standard deviation, from 0 to kLargest, where it is 1.
  const float* not_noise() const noexcept { return not_noise_.data(); }

  static constexpr int kPerSigma = 16;
  static constexpr double kLargest = 10.0;

 private:
  int length_ = 0;
  double threshold_ = 0.0;
  double weak_threshold_ = 0.0;
  std::array<float, static_cast<std::size_t>(kLargest* kPerSigma) + 1> not_noise_{};
};

}  // namespace striper::detail
