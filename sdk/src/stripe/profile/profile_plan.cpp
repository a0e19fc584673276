// SPDX-License-Identifier: Apache-2.0
#include "stripe/profile/profile_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "core/pixel_box.hpp"

namespace striper::detail {
namespace {

constexpr double kSmallestWidth = 0.45;
constexpr double kLargestWidth = 9.0;
// A narrower one is sampled too coarsely to be a Gaussian.
constexpr double kNarrowestFilter = 0.8;
constexpr double kFilterReach = 3.0;  // Sigmas of the filter's half.
constexpr double kCoreReach = 3.6;    // Beyond, the stripe is below 0.2 %.
constexpr double kWindowReach = 7.0;  // 14 sigmas in all.
constexpr int kLeastRing = 4;         // Pixels of background on either side.
constexpr int kWideRing = 60;
constexpr double kNarrowCoreReach = 3.0;  // There the stripe is below 1.2 %.
constexpr int kLeastNarrowRing = 2;
// From here on, sampling costs a matched filter less than 0.1 %.
constexpr double kCoarseBelow = 1.6;

void set_noise_weights(ProfilePlan& plan) {
  constexpr float kLeast = 0.02F;
  const auto square = [&](int i) {
    const float tap = plan.filter[static_cast<std::size_t>(i)];
    return tap * tap;
  };
  while (plan.noise_reach < plan.taps && square(plan.noise_reach + 1) >= kLeast) {
    ++plan.noise_reach;
  }
  float sum = 0.0F;
  float squares = 0.0F;
  for (int i = 0; i <= plan.noise_reach; ++i) {
    const float times = i == 0 ? 1.0F : 2.0F;
    sum += times * square(i);
    squares += times * square(i) * square(i);
  }
  for (int i = 0; i <= plan.noise_reach; ++i) {
    plan.noise_weight[static_cast<std::size_t>(i)] = square(i) / sum;
  }
  plan.noise_of_weights = std::sqrt(squares) / sum;
}

void make_filter(double sigma, ProfilePlan& plan) {
  plan.taps = std::min(ProfilePlan::kMostTaps, static_cast<int>(std::ceil(kFilterReach * sigma)));
  plan.filter_sigma = static_cast<float>(sigma);
  std::array<double, ProfilePlan::kMostTaps + 3> half{};  // Two zeros beyond the last tap.
  // exp(-i^2 / 2 sigma^2) for successive i by two multiplications each.
  const double first = std::exp(-0.5 / (sigma * sigma));
  double tap_i = 1.0;
  double ratio = first;
  for (int i = 0; i <= plan.taps; ++i, ratio *= first * first) {
    const auto at = static_cast<std::size_t>(i);
    half[at] = tap_i;
    plan.filter[at] = static_cast<float>(tap_i);
    tap_i *= ratio;
  }
  const auto tap = [&](int i) { return half[static_cast<std::size_t>(std::abs(i))]; };
  double sum = 0.0;
  double energy = 0.0;
  double covariance = 0.0;
  for (int i = -plan.taps; i <= plan.taps; ++i) {
    sum += tap(i);
    energy += tap(i) * tap(i);
    covariance += tap(i) * tap(i + 2);
  }
  plan.filter_sum = static_cast<float>(sum);
  plan.filter_energy = static_cast<float>(energy);
  plan.filter_covariance = static_cast<float>(covariance);
  set_noise_weights(plan);
}

// The filter of a stripe of width w, against the derivative of which noise of each kind stands.
// Sampled too coarsely for these integrals, a narrow one errs more: 7 % at a sigma of 0.7 pixels.
void set_filter_errors(double w, ProfilePlan& plan) {
  const double f = plan.filter_sigma;
  const double w2 = w * w;
  const double f2 = f * f;
  const double total = w2 + f2;
  const double cubed = total * total * total;
  const auto to_three_halves = [](double x) { return x * std::sqrt(x); };
  const double per_signal = cubed / (2.0 * std::numbers::pi * w2 * f2);
  const double root_2pi = std::sqrt(2.0 * std::numbers::pi);
  const double white = std::sqrt(std::numbers::pi) / (2.0 * f);
  const double shot = root_2pi * w2 * w / (f * to_three_halves(f2 + 2.0 * w2));
  const double speckle = root_2pi * w2 * w / (f * to_three_halves(2.0 * total));
  const double coarse = 1.0 + 0.14 * std::exp((0.757 - std::max(w, 0.5)) / 0.12);
  plan.filter_white = static_cast<float>(coarse * white * per_signal / w);
  plan.filter_shot = static_cast<float>(shot * per_signal / w);
  plan.filter_speckle = static_cast<float>(speckle * per_signal / w);
  plan.filter_slope = static_cast<float>(cubed / (w2 * w2 * w2));
}

// Sampling adds to the filter's answer at pixel n from a stripe at x its part e cos(2 pi m)
// (Poisson's sum), m = (x f^2 + n w^2) / (w^2 + f^2) the middle of the product of filter and
// stripe.
void set_filter_locking(double w, ProfilePlan& plan) {
  const double f = plan.filter_sigma;
  const double total = w * w + f * f;
  const double two_pi = 2.0 * std::numbers::pi;
  const double e = 2.0 * std::exp(-0.5 * two_pi * two_pi * w * w * f * f / total);
  constexpr double kLeast = 1e-5;
  if (e < kLeast) return;
  const auto shift = [&](double x) {
    const auto part = [&](int n) { return e * std::cos(two_pi * (x * f * f + n * w * w) / total); };
    const double bend = 1.0 / total - (part(1) - 2.0 * part(0) + part(-1));
    return (x / total + 0.5 * (part(1) - part(-1))) / bend - x;
  };
  const auto shape = [&](double x) { return shift(x) / (x * (1.0 - 4.0 * x * x)); };
  constexpr double kNear = 0.15;
  constexpr double kFar = 0.35;
  const double rise = (shape(kFar) - shape(kNear)) / (kFar * kFar - kNear * kNear);
  plan.filter_locking = {static_cast<float>(shape(kNear) - kNear * kNear * rise),
                         static_cast<float>(rise)};
  plan.has_filter_locking = true;
}

void set_noise(const PlanNoise& noise, ProfilePlan& plan) {
  const NoiseModel& model = noise.model;
  plan.variance_floor = static_cast<float>(model.variance_dn2(model.black_level_dn));
  plan.variance_per_dn = static_cast<float>(model.dn_per_electron);
  plan.black_dn = static_cast<float>(model.black_level_dn);
  plan.speckle2 = static_cast<float>(noise.speckle_contrast * noise.speckle_contrast);
  const auto half_taps = std::span(plan.filter).first(static_cast<std::size_t>(plan.taps) + 1);
  plan.dark_noise_gain = static_cast<float>(dark_gain_through(noise, half_taps));
}

// The mean square of what remains of pixel locking, from noiseless trials over the phase.
void set_locking(double width, ProfilePlan& plan) {
  const double sigma = std::sqrt(std::max(0.0, width * width - kPixelBox2));
  const double narrow = std::max(0.0, sigma - 0.5);
  const double whole =
      plan.refine ? 0.0124 * std::exp(-narrow / 0.083) : 0.0087 * std::exp(-narrow / 0.083);
  const double clipped = plan.refine ? 0.001 + 0.003 * std::exp(-narrow / 0.2) : 0.06;
  plan.locking_variance = static_cast<float>(whole * whole);
  plan.clipped_locking_variance = static_cast<float>(clipped * clipped);
}

void set_windows(double typical, BackgroundReach background, ProfilePlan& plan) {
  const bool is_narrow = background == BackgroundReach::kNarrow;
  plan.aligned =
      is_narrow ? 1 : std::clamp(static_cast<int>(0.5 * typical), 1, ProfilePlan::kMostAligned);
  plan.stray = is_narrow ? 1 : 1 + plan.aligned;
  plan.reach = std::max(1 + static_cast<int>(std::ceil(1.2 * typical)), plan.stray + 1);
  if (is_narrow) plan.reach = plan.stray + 1;
  plan.filter_reach = plan.reach + 1 + plan.taps;
  plan.core = is_narrow ? static_cast<int>(std::ceil(kNarrowCoreReach * typical))
                        : plan.stray + static_cast<int>(std::ceil(kCoreReach * typical));
  const int least =
      std::max(plan.core + (is_narrow ? kLeastNarrowRing : kLeastRing), plan.filter_reach);
  const int usual = std::max(static_cast<int>(std::ceil(kWindowReach * typical)), least);
  const int added = background == BackgroundReach::kWide ? kWideRing : 0;
  plan.window = std::min(ProfilePlan::kLargestWindow, is_narrow ? least : usual + added);
}

// Dividing once for all batches.
void set_inverses(ProfilePlan& plan) {
  plan.per_ring_count = 1.0F / plan.ring_count;
  plan.per_ring_squares = 1.0F / plan.ring_squares;
  plan.per_rows = 1.0F / static_cast<float>(2 * plan.window + 1);
  plan.per_filter_root = 1.0F / (plan.filter_sigma * 2.5066283F);
}

}  // namespace

double typical_width(const WidthModel& width) {
  return std::clamp(width.at_pivot, kSmallestWidth, kLargestWidth);
}

// The best multiple, to a few thousandths, of white and shot noise mixed: filter_white + share
// filter_shot at its smallest, `share` the shot noise at the peak in parts of the white.
double filter_sigma(const WidthModel& width, const PlanNoise& noise, bool refine) {
  constexpr double kMostWidening = 1.5;
  const double typical = typical_width(width);
  double widening = 1.0;
  const double shot = noise.model.dn_per_electron * width.amplitude_dn;
  if (!refine && shot > 0.0) {
    const double white =
        (1.0 + noise.dark_noise_gain) * noise.model.variance_dn2(noise.model.black_level_dn);
    widening = std::min(kMostWidening, 1.0 + 0.75 * shot / (shot + 4.5 * white));
  }
  return std::max(kNarrowestFilter, widening * typical);
}

double dark_gain_through(const PlanNoise& noise, std::span<const float> half_taps) {
  const auto reach = static_cast<int>(half_taps.size()) - 1;
  const auto overlap = [&](int lag) {
    double sum = 0.0;
    for (int i = -reach; i + lag <= reach; ++i) {
      sum += static_cast<double>(half_taps[static_cast<std::size_t>(std::abs(i))]) *
             static_cast<double>(half_taps[static_cast<std::size_t>(std::abs(i + lag))]);
    }
    return sum;
  };
  double shared = 0.0;
  for (int lag = 1; lag <= 3; ++lag) {
    const float correlation = noise.dark_noise_correlation[static_cast<std::size_t>(lag) - 1];
    if (correlation != 0.0F) shared += 2.0 * static_cast<double>(correlation) * overlap(lag);
  }
  return noise.dark_noise_gain * (1.0 + shared / overlap(0));
}

ProfilePlan plan_profile(const WidthModel& width, const PlanNoise& noise, bool refine,
                         BackgroundReach reach) {
  ProfilePlan plan;
  const double typical = typical_width(width);
  plan.width = static_cast<float>(width.at(0.0));
  plan.width_slope = static_cast<float>(width.slope);
  plan.smallest_width = static_cast<float>(std::max(kSmallestWidth, 0.5 * typical));
  plan.largest_width = static_cast<float>(std::min(kLargestWidth, 1.5 * typical));
  make_filter(filter_sigma(width, noise, refine), plan);
  set_filter_errors(typical, plan);
  set_noise(noise, plan);
  plan.refine = refine;
  if (typical < kCoarseBelow && !refine) set_filter_locking(typical, plan);
  set_locking(typical, plan);

  set_windows(typical, reach, plan);
  for (int q = plan.core + 1; q <= plan.window; ++q) {
    plan.ring_count += 2.0F;
    plan.ring_squares += 2.0F * static_cast<float>(q * q);
  }
  set_inverses(plan);
  return plan;
}

}  // namespace striper::detail
