// SPDX-License-Identifier: Apache-2.0
#include "detect/curb/ground_roughness.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace striper::detail {
namespace {

constexpr double kMostPaved_m = 0.005;

// Scatters that ground has, a factor of two apart, and how often. Stones and slabs are smooth to a
// millimetre; of grass only the tips are seen, which scatter by half a centimetre.
constexpr std::array<GroundRoughness::Scatter, 3> kPavedScatters{
    {{0.0003, 0.3}, {0.0008, 0.4}, {0.0015, 0.3}}};
constexpr std::array<GroundRoughness::Scatter, 4> kOvergrownScatters{
    {{0.004, 0.35}, {0.008, 0.3}, {0.016, 0.2}, {0.03, 0.15}}};

// What stands on the ground, and speckle that was not left out: anywhere in a metre.
constexpr double kStrange = 0.03;

// Pavements fall by 2 to 3 %, ramped ones by 6, banks by more.
constexpr double kLean = 0.06;

constexpr double kSeenAmongBlades = 0.5;

constexpr int kRounds = 3;  // After three what is strange has no weight.

double density(double residual, double variance) noexcept {
  return std::exp(-0.5 * residual * residual / variance) /
         std::sqrt(2.0 * std::numbers::pi * variance);
}

}  // namespace

bool is_paved(double scatter_m) noexcept { return scatter_m < kMostPaved_m; }

// One metre across a line does q / distance to q.
double scatter_m(const InverseRanges& ranges, const Run& run) noexcept {
  const double excess = run.fit.dof() > 0 ? run.fit.chi2 / run.fit.dof() - 1.0 : 0.0;
  if (!(excess > 0.0)) return 0.0;
  const std::size_t middle = (run.from + run.to) / 2;
  const double q = run.fit.at(ranges.cosine[middle], ranges.sine[middle]);
  return std::sqrt(excess / ranges.weight[middle]) / (q * run.fit.parameters.norm());
}

void GroundRoughness::end_at(double out_m) {
  std::erase_if(heights_, [&](const Height& one) { return one.at_m.x() > out_m; });
}

double GroundRoughness::log_odds_of_overgrown() const noexcept {
  if (!can_tell()) return 0.0;
  return log_likelihood(kOvergrownScatters) - log_likelihood(kPavedScatters);
}

double GroundRoughness::log_odds_of_too_few(double returns) noexcept {
  const auto log_probability = [](double mean) {
    double sum = 0.0;
    double term = 1.0;
    for (std::size_t n = 0; n < kFewest; ++n) {
      sum += term;
      term *= mean / static_cast<double>(n + 1);
    }
    return std::log(sum) - mean;
  };
  return log_probability(kSeenAmongBlades * returns) - log_probability(returns);
}

double GroundRoughness::log_likelihood(std::span<const Scatter> scatters) const noexcept {
  double sum = -std::numeric_limits<double>::infinity();
  for (const Scatter& one : scatters) {
    const double next = std::log(one.part) + log_likelihood(one.sigma_m);
    const double most = std::max(sum, next);
    sum = most + std::log(std::exp(sum - most) + std::exp(next - most));
  }
  return sum;
}

// At the best line, each return weighted by how probably it is of this ground; the line took a
// degree of freedom or two.
double GroundRoughness::log_likelihood(double scatter_m) const noexcept {
  const double from_m = heights_.front().at_m.x();
  Eigen::Vector2d line(0.0, 0.0);
  double log_sum = 0.0;
  for (int round = 0; round <= kRounds; ++round) {
    Eigen::Matrix2d a = Eigen::Vector2d(1e-9, 1.0 / (kLean * kLean)).asDiagonal();
    Eigen::Vector2d b(0.0, 0.0);
    log_sum = 0.0;
    for (const Height& one : heights_) {
      const double variance = one.variance_m2 + scatter_m * scatter_m;
      const Eigen::Vector2d f(1.0, one.at_m.x() - from_m);
      const double likelihood =
          (1.0 - kStrange) * density(one.at_m.y() - line.dot(f), variance) + kStrange;
      const double is_ground = round == 0 ? 1.0 : 1.0 - kStrange / likelihood;
      log_sum += std::log(likelihood);
      a += is_ground / variance * f * f.transpose();
      b += is_ground / variance * one.at_m.y() * f;
    }
    line = a.inverse() * b;
  }
  const auto n = static_cast<double>(heights_.size());
  return log_sum * (n - 2.0) / n;
}

}  // namespace striper::detail
