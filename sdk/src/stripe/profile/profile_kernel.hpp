// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stripe/profile/peak_seed.hpp"

namespace striper::detail {

/// A lit frame as the profile kernel reads it: pixel k of scan line l is at l * line_step + k *
/// across_step. Steps in elements, one pair for each image.
struct ProfileImages {
  struct Steps {
    std::ptrdiff_t line = 0;
    std::ptrdiff_t across = 0;
  };
  const void* lit = nullptr;
  const void* dark = nullptr;            // Null: nothing to subtract.
  const std::uint8_t* masked = nullptr;  // Null: none is masked.
  const float* variance = nullptr;       // What `lit - dark` leaves beyond noise. Null: nothing.
  Steps lit_steps, dark_steps, masked_steps, variance_steps;
  bool is_16_bit = false;
  int length = 0;  // Pixels across the stripe.
  int full_scale_dn = 0;
};

/// How the kernel measures; made by `plan_profile`. Lengths in image pixels.
struct ProfilePlan {
  static constexpr int kMostTaps = 32;
  static constexpr int kLargestWindow = 96;
  static constexpr int kMostAligned = 4;

  // Matched filter: a Gaussian of the frame's width, cut at `taps` pixels.
  int taps = 0;
  std::array<float, kMostTaps + 1> filter{};
  float filter_sigma = 0;
  float filter_sum = 0;
  float filter_energy = 0;      // sum g_i^2
  float filter_covariance = 0;  // sum g_i g_(i+2)

  // The weights of pixels' noise in the filter's answer: g_i^2, those that count, their sum 1.
  int noise_reach = 0;
  std::array<float, kMostTaps + 1> noise_weight{};
  float noise_of_weights = 0;  // The sigma of such a mean, of pixels of sigma 1.

  // The variance of the filter's peak for a stripe of width w and amplitude A: (w (white v + shot A
  // per_dn + speckle A^2 speckle2) + slope w^4 v v_slope) / A^2, v the variance of a pixel of the
  // background and v v_slope that of the background's slope.
  float filter_white = 0, filter_shot = 0, filter_speckle = 0, filter_slope = 0;
  // What sampling moves the peak by, at x from the pixel's middle: x (1 - 4 x^2) ([0] + [1] x^2).
  std::array<float, 2> filter_locking{};
  bool has_filter_locking = false;  // So narrow is the stripe that it matters.

  int reach = 0;         // The filter's peak is looked for this far from the seed,
  int filter_reach = 0;  // for which pixels this far from it are needed;
  int stray = 0;         // farther than this, the seed is moved there first.
  int aligned = 0;  // Seeds are moved so far at most that those of neighbouring scan lines agree.
  int core = 0;     // Beyond this distance from the seed the stripe is gone,
  int window = 0;   // and from there to here is the local background.
  float width = 0;  // The stripe's effective sigma (pixel box included) at pixel 0,
  float width_slope = 0;  // and its change per pixel across.
  float smallest_width = 0;
  float largest_width = 0;
  float ring_count = 0;    // Pixels of background where none is missing,
  float ring_squares = 0;  // and the sum of their squared distances from the seed.

  // One over: those two, the window's rows, and filter_sigma sqrt(2 pi).
  float per_ring_count = 0, per_ring_squares = 0, per_rows = 0, per_filter_root = 0;

  // variance = floor + per_dn * max(value - black, 0) + speckle2 * (value - background)^2
  float variance_floor = 0;
  float variance_per_dn = 0;
  float black_dn = 0;
  float speckle2 = 0;
  // Of the dark image, in parts of a single exposure's; 0 where the floor was measured on lit -
  // dark and knows it already.
  float dark_noise_gain = 0;

  float locking_variance = 0;          // What the pixel grid adds to every error, pixels^2,
  float clipped_locking_variance = 0;  // and where pixels are clipped.

  bool refine = false;  // Gauss-Newton after the matched filter.
};

/// What was measured, one element per seed. Arrays of the caller, of at least `count` rounded up to
/// a multiple of kMultiple.
struct PeakMeasurements {
  static constexpr int kMultiple = 64;
  std::int32_t* across = nullptr;  // Whole pixel nearest the filter's peak.
  float* offset = nullptr;         // Position minus `across`.
  float* amplitude = nullptr;      // DN above the background.
  float* width = nullptr;         // Effective sigma from the filter's curvature; clipped: expected.
  float* sigma = nullptr;         // One-sigma error of the position, pixels.
  float* significance = nullptr;  // The filter's response in standard deviations of noise.
  float* snr = nullptr;           // Amplitude over the noise at the peak pixel.
  float* clipped = nullptr;       // Number of clipped pixels in the core.
  float* level = nullptr;         // The background at the peak to a few pixels, DN,
  float* slope = nullptr;         // and its change per pixel.
};

/// Measures each seed's peak: linear background from both sides, matched filter, log-parabola, and
/// with `plan.refine` Gauss-Newton on (position, amplitude, background, slope). Of clipped pixels
/// side by side about the peak the middle is a measurement of its own. Where the image's border or
/// a mask cuts the profile, its error has what a wrong width moves it by.
void measure_profiles(const ProfileImages& images, const ProfilePlan& plan, const PeakSeed* seeds,
                      int count, const PeakMeasurements& out);

}  // namespace striper::detail
