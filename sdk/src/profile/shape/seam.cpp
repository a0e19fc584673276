// SPDX-License-Identifier: Apache-2.0
#include "profile/shape/seam.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

using Estimate = CurveSmoother::Estimate;

// So far from the seam that was found, returns: a step of half a sigma is known to that.
constexpr std::size_t kReach = 24;
// -2 log likelihood beyond which a place of the seam does not count: one in 1e5.
constexpr double kNegligible = 23.0;
constexpr double kMostGain = -200.0;  // So that nothing overflows.

// -2 log likelihood of a return that is not in the estimate.
double surprise_of(double e, double weight, double variance) noexcept {
  const double ratio = 1.0 + weight * variance;
  return weight * e * e / ratio + std::log(ratio);
}

// The same of one that is: by what the others alone would say.
double surprise_without(double e, double weight, double variance) noexcept {
  constexpr double kLeast = 0.05;  // Of a return that is nearly alone with its estimate.
  const double ratio = std::max(1.0 - weight * variance, kLeast);
  return weight * e * e / ratio - std::log(ratio);
}

}  // namespace

CurveSmoother::Estimate Continuation::at(const InverseRanges& ranges,
                                         std::size_t i) const noexcept {
  const double c = ranges.cosine[i];
  const double n = ranges.sine[i];
  const double s = std::abs(ranges.turn(outermost, i));
  return {line.p0 * c + line.p1 * n,
          line.p00 * c * c + 2.0 * line.p01 * c * n + line.p11 * n * n + density * s * s * s / 3.0};
}

// From the seam outwards. Returns the sum of all weights of seams on this side.
double Seam::add_side(const InverseRanges& ranges, const SmoothedSurface& own,
                      const Continuation& other, bool is_right,
                      const std::vector<Estimate>& estimates, std::vector<Other>& others) {
  others.clear();
  double growth = 0.0;
  double sum = 0.0;
  const std::size_t most = std::min(own.to - own.from, kReach);
  for (std::size_t k = 0; k < most && growth < kNegligible; ++k) {
    const std::size_t i = is_right ? own.from + k : own.to - 1 - k;
    const Estimate there = other.at(ranges, i);
    const double weight = ranges.weight[i];
    growth += surprise_of(ranges.q[i] - there.q, weight, there.variance) -
              surprise_without(ranges.q[i] - estimates[i].q, weight, estimates[i].variance);
    others.push_back({there, std::exp(-0.5 * std::max(growth, kMostGain))});
    sum += others.back().weight;
  }
  return sum;
}

// A return is the other's if the seam is behind it.
void Seam::mix(const SmoothedSurface& own, bool is_right, double total,
               const std::vector<Other>& others, std::vector<Estimate>& estimates) {
  double behind = 0.0;
  for (std::size_t k = others.size(); k-- > 0;) {
    behind += others[k].weight;
    Estimate& here = estimates[is_right ? own.from + k : own.to - 1 - k];
    const Estimate& there = others[k].estimate;
    const double part = behind / total;
    const double between = there.q - here.q;
    here.q += part * between;
    here.variance = (1.0 - part) * here.variance + part * there.variance +
                    part * (1.0 - part) * between * between;
  }
}

void Seam::blend(const InverseRanges& ranges, const SmoothedSurface& left,
                 const SmoothedSurface& right, std::vector<Estimate>& estimates) {
  const double sum_left = add_side(ranges, left, right.before, false, estimates, on_left_);
  const double sum_right = add_side(ranges, right, left.beyond, true, estimates, on_right_);
  const double total = 1.0 + sum_left + sum_right;
  mix(left, false, total, on_left_, estimates);
  mix(right, true, total, on_right_, estimates);
}

}  // namespace striper::detail
