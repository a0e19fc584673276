// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include <striper/compare/centroid_repeatability.hpp>
#include <striper/core/error.hpp>
#include <striper/core/statistics.hpp>

namespace striper {
namespace {

constexpr double kWidest_px = 5.0;
constexpr int kReach = 12;  // Pixels on either side: 2.4 of the widest stripe's sigmas.
// Twice as many phases, or steps of the peak's value, change the result by less than .1 %.
constexpr int kPhases = 64;
constexpr int kPeakSteps = 32;
// Of what is left out nothing is as likely as 1e-5: pixels that far below the highest, values of
// the peak that far off.
constexpr double kPeakReach = 6.0;
constexpr double kValueReach = 4.5;
constexpr double kLeastChance = 1e-6;
constexpr double kLowestSnr = 2.0;
// Gauss's three points of a normal distribution.
constexpr std::array kPlaces{-std::numbers::sqrt3, 0.0, std::numbers::sqrt3};
constexpr std::array kWeights{1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0};

double density(double x) { return std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi); }

using Profile = std::array<double, 2 * kReach + 1>;

// A Gaussian of height 1 as the pixels integrate it.
Profile profile_of(double sigma_px, double phase_px) {
  Profile profile{};
  for (int k = -kReach; k <= kReach; ++k) {
    const double from = (k - 0.5 - phase_px) / sigma_px;
    const double to = (k + 0.5 - phase_px) / sigma_px;
    profile[static_cast<std::size_t>(k + kReach)] =
        sigma_px * std::sqrt(2.0 * std::numbers::pi) * (normal_below(to) - normal_below(from));
  }
  return profile;
}

struct Outcome {
  double position_px;
  double chance;
};

class Centroids {
 public:
  Centroids(const Profile& profile, double noise) : profile_(profile), noise_(noise) {}

  // Where the centroid may be, in rising order.
  std::vector<Outcome> outcomes() {
    outcomes_.clear();
    const double highest = *std::max_element(profile_.begin(), profile_.end());
    for (std::size_t k = 1; k + 1 < profile_.size(); ++k) {
      if (profile_[k] > highest - kPeakReach * noise_) add_peak(k);
    }
    std::sort(outcomes_.begin(), outcomes_.end(),
              [](const Outcome& a, const Outcome& b) { return a.position_px < b.position_px; });
    return outcomes_;
  }

 private:
  void add_peak(std::size_t k) {
    constexpr double kStep = 2.0 * kValueReach / kPeakSteps;
    for (int n = 0; n < kPeakSteps; ++n) {
      const double z = kStep * (n + 0.5) - kValueReach;
      const double peak = profile_[k] + noise_ * z;
      double chance = kStep * density(z);
      for (std::size_t j = 0; j < profile_.size(); ++j) {
        if (j != k) chance *= normal_below((peak - profile_[j]) / noise_);
      }
      if (chance > kLeastChance) add_neighbours(k, peak, chance);
    }
  }

  // Both are as they are, but less than the peak; and less than nothing counts as nothing.
  void add_neighbours(std::size_t k, double peak, double chance) {
    const auto before = values_below(peak, profile_[k - 1]);
    const auto after = values_below(peak, profile_[k + 1]);
    for (std::size_t i = 0; i < before.size(); ++i) {
      for (std::size_t j = 0; j < after.size(); ++j) {
        const double sum = before[i] + peak + after[j];
        outcomes_.push_back({static_cast<double>(k) + (after[j] - before[i]) / sum,
                             chance * kWeights[i] * kWeights[j]});
      }
    }
  }

  // Three that stand for a normal distribution cut off at the peak, by its mean and variance.
  std::array<double, kPlaces.size()> values_below(double peak, double mean) const {
    const double cut = (peak - mean) / noise_;
    const double hazard = density(cut) / std::max(normal_below(cut), 1e-12);
    const double own_mean = mean - noise_ * hazard;
    const double own_sigma =
        noise_ * std::sqrt(std::max(0.0, 1.0 - cut * hazard - hazard * hazard));
    std::array<double, kPlaces.size()> values{};
    for (std::size_t i = 0; i < kPlaces.size(); ++i)
      values[i] = std::max(0.0, own_mean + own_sigma * kPlaces[i]);
    return values;
  }

  const Profile& profile_;
  double noise_;
  std::vector<Outcome> outcomes_;
};

// Of two that are drawn from the outcomes, by running sums.
double mean_distance(const std::vector<Outcome>& outcomes) {
  double sum = 0.0;
  double chance = 0.0;
  double moment = 0.0;
  for (const Outcome& outcome : outcomes) {
    sum += 2.0 * outcome.chance * (outcome.position_px * chance - moment);
    chance += outcome.chance;
    moment += outcome.chance * outcome.position_px;
  }
  return sum / (chance * chance);
}

void require_within(const char* name, double value, double least, double most) {
  if (value >= least && value <= most) return;
  throw Error(ErrorKind::kBadValue,
              fmt::format("{} is {:g}, expected {:g} to {:g}", name, value, least, most));
}

}  // namespace

double centroid_change_px(double sigma_px, double snr) {
  require_within("sigma_px", sigma_px, 0.3, kWidest_px);
  require_within("snr", snr, kLowestSnr, 1e6);
  double sum = 0.0;
  for (int n = 0; n < kPhases; ++n) {
    const Profile profile = profile_of(sigma_px, (n + 0.5) / kPhases - 0.5);
    sum += mean_distance(Centroids(profile, 1.0 / snr).outcomes());
  }
  return sum / kPhases;
}

double centroid_snr(double sigma_px, double change_px) {
  require_within("change_px", change_px, 0.02, 1.0);
  constexpr double kHighestSnr = 2e4;  // Changes by far less than 0.02 px at any width.
  constexpr double kClose = 1.005;     // The form itself is good to 2 %.
  double low = kLowestSnr;
  double high = kHighestSnr;
  // The change falls about as the inverse of the SNR: where that leads, and a little beyond on
  // either side, ends the search in a few steps; else the middle does.
  double tried = std::clamp(0.3 / change_px, 2.0 * low, 0.5 * high);
  while (high > kClose * low) {
    const double change = centroid_change_px(sigma_px, tried);
    (change > change_px ? low : high) = tried;
    const double led = tried * (change / change_px) * (change > change_px ? 1.002 : 0.998);
    tried = led > low && led < high ? led : std::sqrt(low * high);
  }
  return std::sqrt(low * high);
}

}  // namespace striper
