// SPDX-License-Identifier: Apache-2.0
#include "profile/curve_filter.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

// The product of so many ratios, each below 1e9, cannot overflow.
constexpr double kLargeProduct = 1e200;

}  // namespace

double unit_density(const InverseRanges& ranges, std::size_t from, std::size_t to) noexcept {
  const double spacing = std::abs(ranges.turn(from, from + 1));
  return 1.0 / (ranges.weight[from + (to - from) / 2] * spacing * spacing * spacing);
}

double line_information(const InverseRanges& ranges, std::size_t from, std::size_t to) noexcept {
  const std::size_t about = from + (to - from) / 2;
  LineSums sums;
  for (std::size_t i = from; i < to; ++i) ranges.add_rotated(sums, i, about);
  return sums.determinant();
}

void CurveFilter::begin(const InverseRanges& ranges, std::size_t from) {
  ranges_ = &ranges;
  from_ = from;
  next_ = from + 2;
  density_ = unit_density(ranges, from, from + 2);
  first_information_ = line_information(ranges, from, from + 2);
  const double sine = std::abs(ranges.turn(from, from + 1));
  const double cosine = std::sqrt(1.0 - sine * sine);
  const double v0 = 1.0 / ranges.weight[from];
  const double v1 = 1.0 / ranges.weight[from + 1];
  for (std::size_t k = 0; k < kStrengths; ++k) {
    q_[k] = ranges.q[from + 1];
    slope_[k] = (ranges.q[from + 1] * cosine - ranges.q[from]) / sine;
    qq_[k] = v1;
    qs_[k] = v1 * cosine / sine;
    ss_[k] = (v1 * cosine * cosine + v0) / (sine * sine) + density_ * kStrength[k] * sine / 3.0;
    misfit_[k] = 0.0;
    product_[k] = 1.0;
    logarithm_[k] = 0.0;
  }
}

void CurveFilter::extend(std::size_t to) {
  for (; next_ < to; ++next_) {
    const double sine = std::abs(ranges_->turn(next_ - 1, next_));
    step(sine, std::sqrt(1.0 - sine * sine), ranges_->q[next_], ranges_->weight[next_]);
    for (std::size_t k = 0; k < kStrengths; ++k) {
      if (product_[k] < kLargeProduct) continue;
      logarithm_[k] += std::log(product_[k]);
      product_[k] = 1.0;
    }
  }
}

// All strengths at once, so that the compiler makes vectors of them.
void CurveFilter::step(double sine, double cosine, double q, double weight) {
  const double variance = 1.0 / weight;
  for (std::size_t k = 0; k < kStrengths; ++k) {
    const double density = density_ * kStrength[k];
    const double q0 = cosine * q_[k] + sine * slope_[k];
    const double s0 = cosine * slope_[k] - sine * q_[k];
    const double cross =
        cosine * sine * (ss_[k] - qq_[k]) + (cosine * cosine - sine * sine) * qs_[k];
    const double twice = 2.0 * cosine * sine * qs_[k];
    const double qq = cosine * cosine * qq_[k] + twice + sine * sine * ss_[k] +
                      density * sine * sine * sine / 3.0;
    const double qs = cross + density * sine * sine / 2.0;
    const double ss = sine * sine * qq_[k] - twice + cosine * cosine * ss_[k] + density * sine;
    const double inverse = 1.0 / (qq + variance);
    const double e = q - q0;
    misfit_[k] += e * e * inverse;
    product_[k] *= (qq + variance) * weight;
    q_[k] = q0 + qq * inverse * e;
    slope_[k] = s0 + qs * inverse * e;
    qq_[k] = variance * qq * inverse;
    qs_[k] = variance * qs * inverse;
    ss_[k] = ss - qs * qs * inverse;
  }
}

std::array<double, CurveFilter::kStrengths> CurveFilter::beyond_line(const LineFit& line) const {
  const double of_line =
      line.chi2 + std::log(line_information(*ranges_, from_, next_) / first_information_);
  std::array<double, kStrengths> beyond{};
  for (std::size_t k = 0; k < kStrengths; ++k)
    beyond[k] = misfit_[k] + logarithm_[k] + std::log(product_[k]) - of_line;
  return beyond;
}

CurveFilter::Best CurveFilter::best(const LineFit& line) const {
  const auto beyond = beyond_line(line);
  const auto least =
      static_cast<std::size_t>(std::min_element(beyond.begin(), beyond.end()) - beyond.begin());
  Best best{kStrength[least], beyond[least]};
  if (least == 0 || least + 1 == kStrengths) return best;
  const double left = beyond[least - 1] - beyond[least];
  const double right = beyond[least + 1] - beyond[least];
  const double shift = 0.5 * (left - right) / (left + right);  // In steps of the grid.
  best.strength *= std::pow(kStrength[1] / kStrength[0], shift);
  best.beyond_line -= 0.25 * (left - right) * shift;
  return best;
}

void CurveSmoother::filter(const InverseRanges& ranges, std::size_t from, std::size_t to,
                           double density) {
  const double sine0 = std::abs(ranges.turn(from, from + 1));
  const double cosine0 = std::sqrt(1.0 - sine0 * sine0);
  const double v0 = 1.0 / ranges.weight[from];
  const double v1 = 1.0 / ranges.weight[from + 1];
  filtered_[1] = {ranges.q[from + 1], (ranges.q[from + 1] * cosine0 - ranges.q[from]) / sine0, v1,
                  v1 * cosine0 / sine0,
                  (v1 * cosine0 * cosine0 + v0) / (sine0 * sine0) + density * sine0 / 3.0};
  for (std::size_t i = from + 2; i < to; ++i) {
    const State& last = filtered_[i - 1 - from];
    State& now = predicted_[i - from];
    const double s = std::abs(ranges.turn(i - 1, i));
    const double c = std::sqrt(1.0 - s * s);
    const double twice = 2.0 * c * s * last.qs;
    now.q = c * last.q + s * last.slope;
    now.slope = c * last.slope - s * last.q;
    now.qq = c * c * last.qq + twice + s * s * last.ss + density * s * s * s / 3.0;
    now.qs = c * s * (last.ss - last.qq) + (c * c - s * s) * last.qs + density * s * s / 2.0;
    now.ss = s * s * last.qq - twice + c * c * last.ss + density * s;
    const double variance = 1.0 / ranges.weight[i];
    const double inverse = 1.0 / (now.qq + variance);
    const double e = (ranges.q[i] - now.q) * inverse;
    filtered_[i - from] = {now.q + now.qq * e, now.slope + now.qs * e, variance * now.qq * inverse,
                           variance * now.qs * inverse, now.ss - now.qs * now.qs * inverse};
  }
}

// Rauch, Tung & Striebel 1965.
const std::vector<CurveSmoother::Estimate>& CurveSmoother::smooth(const InverseRanges& ranges,
                                                                  std::size_t from, std::size_t to,
                                                                  double strength) {
  const std::size_t n = to - from;
  filtered_.resize(std::max(filtered_.size(), n));
  predicted_.resize(filtered_.size());
  estimates_.resize(n);
  filter(ranges, from, to, strength * unit_density(ranges, from, from + 2));
  State next = filtered_[n - 1];
  estimates_[n - 1] = {next.q, next.qq};
  for (std::size_t i = n - 1; i-- > 1;) {
    const State& f = filtered_[i];
    const State& p = predicted_[i + 1];
    const double s = std::abs(ranges.turn(from + i, from + i + 1));
    const double c = std::sqrt(1.0 - s * s);
    // Gain = P F' / predicted P.
    const double a00 = c * f.qq + s * f.qs, a01 = c * f.qs - s * f.qq;
    const double a10 = c * f.qs + s * f.ss, a11 = c * f.ss - s * f.qs;
    const double inverse = 1.0 / (p.qq * p.ss - p.qs * p.qs);
    const double g00 = (a00 * p.ss - a01 * p.qs) * inverse;
    const double g01 = (a01 * p.qq - a00 * p.qs) * inverse;
    const double g10 = (a10 * p.ss - a11 * p.qs) * inverse;
    const double g11 = (a11 * p.qq - a10 * p.qs) * inverse;
    const double dq = next.q - p.q, ds = next.slope - p.slope;
    const double d00 = next.qq - p.qq, d01 = next.qs - p.qs, d11 = next.ss - p.ss;
    next = {f.q + g00 * dq + g01 * ds, f.slope + g10 * dq + g11 * ds,
            f.qq + g00 * g00 * d00 + 2.0 * g00 * g01 * d01 + g01 * g01 * d11,
            f.qs + g00 * g10 * d00 + (g00 * g11 + g01 * g10) * d01 + g01 * g11 * d11,
            f.ss + g10 * g10 * d00 + 2.0 * g10 * g11 * d01 + g11 * g11 * d11};
    estimates_[i] = {next.q, next.qq};
  }
  // The first return: what the second's state says of it, and its own measurement.
  const double s = std::abs(ranges.turn(from, from + 1));
  const double c = std::sqrt(1.0 - s * s);
  estimates_[0] = {c * next.q - s * next.slope,
                   c * c * next.qq - 2.0 * c * s * next.qs + s * s * next.ss};
  return estimates_;
}

}  // namespace striper::detail
