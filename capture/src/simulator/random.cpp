// SPDX-License-Identifier: Apache-2.0
#include "simulator/random.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <numbers>

namespace striper::detail {
namespace {

constexpr int kLogFactorials = 128;

std::array<double, kLogFactorials> make_log_factorials() {
  std::array<double, kLogFactorials> table{};
  for (int k = 1; k < kLogFactorials; ++k) {
    table[k] = table[k - 1] + plain_log(static_cast<double>(k));
  }
  return table;
}

// log(k!): exact sums, then Stirling's series, whose next term is below 1e-14 here.
double log_factorial(double k) {
  static const std::array<double, kLogFactorials> table = make_log_factorials();
  if (k < kLogFactorials) return table[static_cast<std::size_t>(k)];
  const double half_log_two_pi = 0.91893853320467274178;
  const double inverse = 1.0 / k;
  const double inverse2 = inverse * inverse;
  return (k + 0.5) * plain_log(k) - k + half_log_two_pi +
         inverse * (1.0 / 12.0 - inverse2 * (1.0 / 360.0 - inverse2 / 1260.0));
}

double poisson_by_inversion(PixelRandom& random, double mean) {
  double remaining = random.uniform();
  double probability = plain_exp(-mean);
  double k = 0.0;
  while (remaining > probability && k < 1000.0) {
    remaining -= probability;
    k += 1.0;
    probability *= mean / k;
  }
  return k;
}

// Hoermann, "The transformed rejection method for generating Poisson random variables", 1993.
double poisson_by_rejection(PixelRandom& random, double mean) {
  const double b = 0.931 + 2.53 * std::sqrt(mean);
  const double a = -0.059 + 0.02483 * b;
  const double v_r = 0.9277 - 3.6224 / (b - 2.0);
  while (true) {
    const double u = random.uniform() - 0.5;
    const double v = random.uniform();
    const double us = 0.5 - std::abs(u);
    const double k = std::floor((2.0 * a / us + b) * u + mean + 0.43);
    if (us >= 0.07 && v <= v_r) return k;
    if (k < 0.0 || (us < 0.013 && v > us)) continue;
    const double inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
    const double bound = -mean + k * plain_log(mean) - log_factorial(k);
    if (plain_log(v * inverse_alpha / (a / (us * us) + b)) <= bound) return k;
  }
}

}  // namespace

double plain_log(double x) noexcept {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  int exponent = static_cast<int>(bits >> 52) - 1023;
  double mantissa = std::bit_cast<double>((bits & 0x000FFFFFFFFFFFFFULL) | 0x3FF0000000000000ULL);
  if (mantissa > std::numbers::sqrt2) {
    mantissa *= 0.5;
    ++exponent;
  }
  // log(m) = 2 artanh(s), |s| <= 0.172: ten terms of the series reach 1e-16.
  const double s = (mantissa - 1.0) / (mantissa + 1.0);
  const double s2 = s * s;
  double sum = 0.0;
  for (int n = 19; n >= 1; n -= 2) sum = sum * s2 + 1.0 / n;
  return 2.0 * s * sum + exponent * std::numbers::ln2;
}

double plain_exp(double x) noexcept {
  const double n = std::floor(x / std::numbers::ln2 + 0.5);
  const double r = x - n * std::numbers::ln2;
  double sum = 1.0;
  for (int k = 14; k >= 1; --k) sum = 1.0 + sum * r / k;
  return sum * std::bit_cast<double>(static_cast<std::uint64_t>(static_cast<int>(n) + 1023) << 52);
}

double PixelRandom::normal() noexcept {
  while (true) {
    const double x = 2.0 * uniform() - 1.0;
    const double y = 2.0 * uniform() - 1.0;
    const double s = x * x + y * y;
    if (s < 1.0 && s > 0.0) return x * std::sqrt(-2.0 * plain_log(s) / s);
  }
}

double PixelRandom::poisson(double mean) noexcept {
  if (!(mean > 0.0)) return 0.0;
  return mean < 10.0 ? poisson_by_inversion(*this, mean) : poisson_by_rejection(*this, mean);
}

}  // namespace striper::detail
