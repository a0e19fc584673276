// SPDX-License-Identifier: Apache-2.0
#include "stripe/profile_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

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
// From here on, sampling costs a matched filter less than 0.1 % (see filter_sigma).
constexpr double kCoarseBelow = 1.6;

void make_filter(double sigma, ProfilePlan& plan) {
  plan.taps = std::min(ProfilePlan::kMostTaps, static_cast<int>(std::ceil(kFilterReach * sigma)));
  plan.filter_sigma = static_cast<float>(sigma);
  std::array<double, ProfilePlan::kMostTaps + 3> half{};  // Two zeros beyond the last tap.
  for (int i = 0; i <= plan.taps; ++i) {
    const auto at = static_cast<std::size_t>(i);
    half[at] = std::exp(-0.5 * i * i / (sigma * sigma));
    plan.filter[at] = static_cast<float>(half[at]);
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
  const double sigma = std::sqrt(std::max(0.0, width * width - 1.0 / 12.0));
  const double narrow = std::max(0.0, sigma - 0.5);
  const double whole =
      plan.refine ? 0.0085 * std::exp(-narrow / 0.096) : 0.0184 * std::exp(-narrow / 0.12);
  const double clipped = plan.refine ? 0.001 + 0.003 * std::exp(-narrow / 0.2) : 0.06;
  plan.locking_variance = static_cast<float>(whole * whole);
  plan.clipped_locking_variance = static_cast<float>(clipped * clipped);
}

}  // namespace

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
                         bool wide_background) {
  ProfilePlan plan;
  const double typical = std::clamp(width.at_pivot, kSmallestWidth, kLargestWidth);
  plan.width = static_cast<float>(width.at(0.0));
  plan.width_slope = static_cast<float>(width.slope);
  plan.smallest_width = static_cast<float>(std::max(kSmallestWidth, 0.5 * typical));
  plan.largest_width = static_cast<float>(std::min(kLargestWidth, 1.5 * typical));
  make_filter(std::max(kNarrowestFilter, typical), plan);
  set_noise(noise, plan);
  plan.refine = refine;
  plan.is_coarse = typical < kCoarseBelow;
  set_locking(typical, plan);

  plan.aligned = std::max(1, static_cast<int>(0.5 * typical));
  plan.stray = 1 + plan.aligned;
  plan.reach = std::max(1 + static_cast<int>(std::ceil(1.2 * typical)), plan.stray + 1);
  plan.filter_reach = plan.reach + 1 + plan.taps;
  plan.core = plan.stray + static_cast<int>(std::ceil(kCoreReach * typical));
  const int wanted = std::max(static_cast<int>(std::ceil(kWindowReach * typical)),
                              std::max(plan.core + kLeastRing, plan.filter_reach));
  plan.window = std::min(ProfilePlan::kLargestWindow, wanted + (wide_background ? kWideRing : 0));
  for (int q = plan.core + 1; q <= plan.window; ++q) {
    plan.ring_count += 2.0F;
    plan.ring_squares += 2.0F * static_cast<float>(q * q);
  }
  return plan;
}

}  // namespace striper::detail
