// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <Eigen/Core>

namespace striper::detail {

/// How much more of a stripe exposure `first` shows over `second` than `second` over `first`, as a
/// fraction of what a clear stripe gives. Exposures by their numbers.
struct Surplus {
  std::uint64_t first;
  std::uint64_t second;
  double value;
  double weight;
};

/// The same of exposure `number` over one before and one after it, and of both over it.
struct Triple {
  std::uint64_t before;
  std::uint64_t number;
  std::uint64_t after;
  double surplus;
  double weight;
};

inline constexpr std::size_t kLongestPeriod = 6;
using Levels = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kLongestPeriod, 1>;

/// How much each position of a period shows the stripe, relative to the position that shows it
/// least.
struct PeriodFit {
  std::size_t period = 0;
  Levels level;
  double residual = 0.0;     ///< Mean square.
  bool is_complete = false;  ///< Every position was seen and compared.
};

/// Explains each surplus by the levels of its two positions, by least squares. No allocation.
/// @param period up to kLongestPeriod.
PeriodFit fit_period(std::size_t period, std::span<const Surplus> surpluses);

/// Which exposures of a period one laser lights: bit p of `lit` for position p.
struct Pattern {
  std::size_t period = 0;
  unsigned lit = 0;

  bool is_lit(std::uint64_t number) const { return (lit >> (number % period) & 1U) != 0; }
};

struct PatternFit {
  Pattern pattern;
  double surplus = 0.0;
  double residual = 0.0;  ///< Mean square.
  int explained = 0;      ///< Triples in which the pattern expects a stripe.
};

/// Explains the triples by one stripe that the pattern lights. No allocation.
PatternFit fit_pattern(const Pattern& pattern, std::span<const Triple> triples);

}  // namespace striper::detail
