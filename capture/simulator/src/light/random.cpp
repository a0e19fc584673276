// SPDX-License-Identifier: Apache-2.0
#include "light/random.hpp"

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

double polynomial(double x, const std::array<double, 8>& coefficients) {
  double sum = 0.0;
  for (int i = 7; i >= 0; --i) sum = sum * x + coefficients[static_cast<std::size_t>(i)];
  return sum;
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
  for (int k = 14; k >= 1; --k) sum = 1.0 + sum * r * (1.0 / k);
  return sum * std::bit_cast<double>(static_cast<std::uint64_t>(static_cast<int>(n) + 1023) << 52);
}

double normal_quantile(double p) noexcept {
  const double q = p - 0.5;
  if (std::abs(q) <= 0.425) {
    const double r = 0.180625 - q * q;
    return q *
           polynomial(r, {3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3,
                          1.3731693765509461125e4, 4.5921953931549871457e4, 6.7265770927008700853e4,
                          3.3430575583588128105e4, 2.5090809287301226727e3}) /
           polynomial(r, {1.0, 4.2313330701600911252e1, 6.8718700749205790830e2,
                          5.3941960214247511077e3, 2.1213794301586595867e4, 3.9307895800092710610e4,
                          2.8729085735721942674e4, 5.2264952788528545610e3});
  }
  const double r = std::sqrt(-plain_log(q < 0.0 ? p : 1.0 - p));
  const double tail =
      r <= 5.0 ? polynomial(r - 1.6, {1.42343711074968357734e0, 4.63033784615654529590e0,
                                      5.76949722146069140550e0, 3.64784832476320460504e0,
                                      1.27045825245236838258e0, 2.41780725177450611770e-1,
                                      2.27238449892691845833e-2, 7.74545014278341407640e-4}) /
                     polynomial(r - 1.6, {1.0, 2.05319162663775882187e0, 1.67638483018380384940e0,
                                          6.89767334985100004550e-1, 1.48103976427480074590e-1,
                                          1.51986665636164571966e-2, 5.47593808499534494600e-4,
                                          1.05075007164441684324e-9})
               : polynomial(r - 5.0, {6.65790464350110377720e0, 5.46378491116411436990e0,
                                      1.78482653991729133580e0, 2.96560571828504891230e-1,
                                      2.65321895265761230930e-2, 1.24266094738807843860e-3,
                                      2.71155556874348757815e-5, 2.01033439929228813265e-7}) /
                     polynomial(r - 5.0, {1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1,
                                          1.48753612908506148525e-2, 7.86869131145613259100e-4,
                                          1.84631831751005468180e-5, 1.42151175831644588870e-7,
                                          2.04426310338993978564e-15});
  return q < 0.0 ? -tail : tail;
}

double PixelRandom::poisson(double mean) noexcept {
  if (!(mean > 0.0)) return 0.0;
  return mean < 10.0 ? poisson_by_inversion(*this, mean) : poisson_by_rejection(*this, mean);
}

}  // namespace striper::detail
