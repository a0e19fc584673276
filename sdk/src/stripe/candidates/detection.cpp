// SPDX-License-Identifier: Apache-2.0
#include "stripe/candidates/detection.hpp"

#include <cmath>
#include <numbers>

#include <striper/core/statistics.hpp>

namespace striper::detail {
namespace {

// The response that a scan line of `length` noise pixels exceeds with probability `rate`.
double threshold_for(int length, double rate) {
  const double tail = -std::expm1(std::log1p(-rate) / length);
  double low = 0.0;
  double high = 20.0;
  for (int n = 0; n < 60; ++n) {
    const double middle = 0.5 * (low + high);
    (normal_above(middle) > tail ? low : high) = middle;
  }
  return low;
}

}  // namespace

void Detection::prepare(int length, double false_alarm_rate, double weak_false_alarm_rate) {
  if (length == length_) return;
  length_ = length;
  threshold_ = threshold_for(length, false_alarm_rate);
  weak_threshold_ = threshold_for(length, weak_false_alarm_rate);
  for (std::size_t i = 0; i < not_noise_.size(); ++i) {
    const double z = static_cast<double>(i) / kPerSigma;
    not_noise_[i] = static_cast<float>(std::exp(length * std::log1p(-normal_above(z))));
  }
}

}  // namespace striper::detail
