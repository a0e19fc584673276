// SPDX-License-Identifier: Apache-2.0
#include "light/gaussian_integral.hpp"

#include <array>
#include <cmath>
#include <cstddef>

namespace striper::detail {
namespace {

constexpr double kSqrtTwoPi = 2.5066282746310002;
constexpr int kCellsPerUnit = 128;
constexpr int kReach = 8;  // Beyond it the functions are their limits to 1e-15.
constexpr double kSmall = 0.02;

double density(double x) noexcept { return std::exp(-0.5 * x * x) / kSqrtTwoPi; }

struct Knot {
  double density;
  double cdf;
  double integral;
};

using Table = std::array<Knot, 2 * kReach * kCellsPerUnit + 2>;

Table make_table() {
  Table table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double x = static_cast<double>(i) / kCellsPerUnit - kReach;
    const double cdf = 0.5 * std::erfc(-x / std::sqrt(2.0));
    table[i] = {density(x), cdf, x * cdf + density(x)};
  }
  return table;
}

const Table& table() noexcept {
  static const Table knots = make_table();
  return knots;
}

/// The cubic with given values and slopes (per cell) at 0 and 1.
double hermite(double t, double from, double from_slope, double to, double to_slope) noexcept {
  const double rise = to - from;
  return from + t * (from_slope + t * (3.0 * rise - 2.0 * from_slope - to_slope +
                                       t * (from_slope + to_slope - 2.0 * rise)));
}

}  // namespace

double normal_cdf(double x) noexcept {
  if (x <= -kReach) return 0.0;
  if (x >= kReach) return 1.0;
  const double cell = (x + kReach) * kCellsPerUnit;
  const auto i = static_cast<std::size_t>(cell);
  const Knot& a = table()[i];
  const Knot& b = table()[i + 1];
  return hermite(cell - static_cast<double>(i), a.cdf, a.density / kCellsPerUnit, b.cdf,
                 b.density / kCellsPerUnit);
}

double normal_cdf_integral(double x) noexcept {
  if (x <= -kReach) return 0.0;
  if (x >= kReach) return x;
  const double cell = (x + kReach) * kCellsPerUnit;
  const auto i = static_cast<std::size_t>(cell);
  const Knot& a = table()[i];
  const Knot& b = table()[i + 1];
  return hermite(cell - static_cast<double>(i), a.integral, a.cdf / kCellsPerUnit, b.integral,
                 b.cdf / kCellsPerUnit);
}

double mean_ridge(double x0, double width_a, double width_b) noexcept {
  const double a = std::abs(width_a);
  const double b = std::abs(width_b);
  if (std::abs(x0) - 0.5 * (a + b) > 7.0) return 0.0;
  if (a < kSmall && b < kSmall) return std::exp(-0.5 * x0 * x0);
  if (a < kSmall || b < kSmall) {
    const double width = std::fmax(a, b);
    return kSqrtTwoPi / width * (normal_cdf(x0 + 0.5 * width) - normal_cdf(x0 - 0.5 * width));
  }
  const double sum = 0.5 * (a + b);
  const double difference = 0.5 * (a - b);
  return kSqrtTwoPi / (a * b) *
         (normal_cdf_integral(x0 + sum) - normal_cdf_integral(x0 + difference) -
          normal_cdf_integral(x0 - difference) + normal_cdf_integral(x0 - sum));
}

}  // namespace striper::detail
