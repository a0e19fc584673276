// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {

/// Where the stripe is in every scan line, given all scan lines: the posterior of a hidden Markov
/// chain along the stripe.
///
/// The states of a scan line are its pixels and "absent". A pixel's evidence is the response of a
/// zero-mean matched filter in standard deviations of the noise there, as a likelihood ratio over
/// amplitudes from barely visible to strong. From scan line to scan line the stripe moves by at
/// most three pixels, or rarely jumps, or goes. Forward and backward (Rabiner 1989) give each
/// pixel's probability.
///
/// Cost: about 16 ns a pixel of the scan lines that are asked for, 5 ms for all of 640x480. No
/// allocation after the first frame of a size.
class ContinuousTracker {
 public:
  struct Answer {
    std::int32_t across = -1;  // Pixel; -1: none.
    float probability = 0.0F;  // That the stripe is within two widths of it.
  };

  /// Scan lines side by side, `end` not among them.
  struct Run {
    int first = 0;
    int end = 0;
  };

  /// Each run is a chain by itself; scan lines in none have no answer.
  /// @param width effective sigma of the stripe, @param noise of lit - dark, besides what
  /// `frame.variance` adds.
  void track(const LitFrame& frame, StripeAxis axis, double width, const PlanNoise& noise,
             std::span<const Run> runs);

  const Answer& of_line(int line) const { return answers_[static_cast<std::size_t>(line)]; }

 private:
  template <typename Pixel>
  void find_evidence(const LitFrame& frame, StripeAxis axis, const PlanNoise& noise,
                     const Run& run);
  template <typename Pixel>
  void load_line(const LitFrame& frame, StripeAxis axis, int line);
  template <typename Pixel>
  void load_noise(const LitFrame& frame, StripeAxis axis, int line, const PlanNoise& noise);
  void repeat_ends(std::vector<float>& padded) const;
  void make_filter(double width);
  void correlate(const std::vector<float>& padded, const std::vector<float>& taps,
                 float* out) const;
  void sum_windows(bool has_extra, float* sums);
  void filter_line(bool has_extra, float* evidence);
  void run_forward(const Run& run);
  void run_backward(const Run& run);
  void step(const float* previous, float previous_absent, float* next, float& next_absent);
  void normalise(float* present, float& absent) const;
  void decide(int line, const float* backward, float backward_absent);
  float* row_of(std::vector<float>& table, int line);

  int lines_ = 0;
  int length_ = 0;
  int taps_ = 0;
  int half_window_ = 0;
  int reach_ = 0;                    // Two widths.
  std::vector<float> core_;          // The filter is these taps, and `flat_` over the whole window.
  std::vector<float> core_squared_;  // Their squares, of sum 1.
  float flat_ = 0.0F;
  std::vector<float> padded_;  // A scan line with `half_window_` pixels of its ends repeated.
  std::vector<char> hidden_;   // Pixels of the scan line that could not be seen.
  std::vector<float> white_;   // The same pixels' noise variance,
  std::vector<float> extra_;   // standard deviation beyond noise,
  std::vector<float> trust_;   // and weight in the background.
  std::vector<float> answer_variance_;  // Of the filter's answer, at each pixel.
  std::vector<float> evidence_;         // [line][pixel]: likelihood ratio.
  std::vector<float> forward_;          // [line][pixel], scaled to a sum of 1 with `absent_`.
  std::vector<float> absent_;           // [line].
  std::vector<float> scratch_, backward_, spread_;
  std::vector<Answer> answers_;
};

}  // namespace striper::detail
