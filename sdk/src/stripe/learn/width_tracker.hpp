// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {

/// Follows the stripe's width from the widths of single profiles: a median, or where the frame
/// shows it a straight line over the position across (a stripe out of focus widens with range).
/// And the mean of their heights. Averages over about 4 frames. The predicted error is wrong by as
/// much as the width, so it is kept to a few percent. Less than 1 us a frame, 4 where the width has
/// changed.
class WidthTracker {
 public:
  static constexpr int kMostSamples = 256;

  bool is_known() const noexcept { return is_known_; }
  bool has_learnt() const noexcept { return has_samples_; }
  const WidthModel& model() const noexcept { return model_; }

  /// Whether it is more than a first guess: expected, or learnt.
  bool is_trusted() const noexcept { return has_samples_ || is_expected_; }

  /// Sets a width that is known from elsewhere, to begin with.
  void expect(const WidthModel& width);

  /// Sets the width without samples: a first guess, or the caller's own.
  void set(double width);

  void begin() {
    samples_.clear();
    amplitudes_dn_ = 0.0;
  }
  bool is_full() const noexcept { return samples_.size() >= kMostSamples; }
  void add(double across, double width, double amplitude_dn) {
    samples_.push_back({across, width});
    amplitudes_dn_ += amplitude_dn;
  }

  /// Takes the samples in. Returns by what factor the width has changed.
  double finish();

 private:
  struct Sample {
    double across;
    double width;
  };
  // A straight line through samples, and what it rests on.
  struct Fit {
    WidthModel model;
    std::size_t inliers = 0;
    double shift = 0.0;   // Of the inliers' mean from where it was thought.
    double spread = 0.0;  // About their mean.
  };
  bool is_outlier(const Sample& sample, const WidthModel& centre) const;
  bool is_stripe_beyond(double distance, double pivot, const WidthModel& centre) const;
  Fit fit_about(const WidthModel& centre) const;
  WidthModel fit_anew();
  WidthModel fit();

  std::vector<Sample> samples_;
  double amplitudes_dn_ = 0.0;  // Their sum.
  std::vector<double> scratch_;
  WidthModel model_;
  double spread_ = 0.0;  // Of single samples.
  bool is_known_ = false;
  bool has_samples_ = false;
  bool is_expected_ = false;
};

}  // namespace striper::detail
