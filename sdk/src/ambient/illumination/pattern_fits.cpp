// SPDX-License-Identifier: Apache-2.0
#include "ambient/illumination/pattern_fits.hpp"

#include <algorithm>

#include <Eigen/Cholesky>

namespace striper::detail {
namespace {

constexpr int kMost = static_cast<int>(kLongestPeriod);
using NormalMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMost, kMost>;

// How much more of a stripe there is than in the exposures before and after it: 1, 0 or -1 stripes.
double expected(const Triple& triple, const Pattern& pattern) {
  const bool are_lit = pattern.is_lit(triple.before) && pattern.is_lit(triple.after);
  const bool are_dark = !pattern.is_lit(triple.before) && !pattern.is_lit(triple.after);
  if (pattern.is_lit(triple.number)) return are_dark ? 1.0 : 0.0;
  return are_lit ? -1.0 : 0.0;
}

}  // namespace

PeriodFit fit_period(std::size_t period, std::span<const Surplus> surpluses) {
  const auto n = static_cast<Eigen::Index>(period);
  const auto position = [period](std::uint64_t number) {
    return static_cast<Eigen::Index>(number % period);
  };
  NormalMatrix normal = NormalMatrix::Zero(n, n);
  Levels right = Levels::Zero(n);
  for (const Surplus& s : surpluses) {
    const Eigen::Index p = position(s.first);
    const Eigen::Index q = position(s.second);
    if (p == q) continue;
    normal(p, p) += s.weight;
    normal(q, q) += s.weight;
    normal(p, q) -= s.weight;
    normal(q, p) -= s.weight;
    right(p) += s.weight * s.value;
    right(q) -= s.weight * s.value;
  }
  PeriodFit fit;
  fit.period = period;
  fit.is_complete = (normal.diagonal().array() > 0.0).all();
  // Levels are known up to a constant; a faint pull towards zero picks one.
  normal.diagonal().array() += 1e-6;
  fit.level = normal.ldlt().solve(right);
  fit.level.array() -= fit.level.minCoeff();
  double weights = 0.0;
  for (const Surplus& s : surpluses) {
    const double rest = s.value - (fit.level(position(s.first)) - fit.level(position(s.second)));
    fit.residual += s.weight * rest * rest;
    weights += s.weight;
  }
  fit.residual /= std::max(1e-9, weights);
  return fit;
}

PatternFit fit_pattern(const Pattern& pattern, std::span<const Triple> triples) {
  PatternFit fit;
  fit.pattern = pattern;
  double sum = 0.0;
  double weight = 0.0;
  double all = 0.0;
  for (const Triple& triple : triples) {
    const double line = expected(triple, pattern);
    all += triple.weight;
    if (line == 0.0) continue;
    sum += triple.weight * line * triple.surplus;
    weight += triple.weight;
    ++fit.explained;
  }
  if (fit.explained == 0) return fit;
  fit.surplus = sum / weight;
  for (const Triple& triple : triples) {
    const double rest = triple.surplus - fit.surplus * expected(triple, pattern);
    fit.residual += triple.weight * rest * rest / all;
  }
  return fit;
}

}  // namespace striper::detail
