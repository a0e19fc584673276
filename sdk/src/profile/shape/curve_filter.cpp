// SPDX-License-Identifier: Apache-2.0
#include "profile/shape/curve_filter.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

constexpr double kSingular = 1e-12;

// The product of so many ratios, each below 1e9, cannot overflow.
constexpr std::size_t kStepsPerLogarithm = 16;

// The spectral density of strength 1 on the elements from `from` on.
double unit_density(const InverseRanges& ranges, std::size_t from) noexcept {
  const double spacing = std::abs(ranges.turn(from, from + 1));
  return 1.0 / (ranges.weight[from + 1] * spacing * spacing * spacing);
}

// By how much the line wanders from element i - 1 to element i, for white noise of density 1: q by
// s^3 / 3, its slope by s, both together by s^2 / 2.
struct Wander {
  double p00, p01, p11;
};

Wander wander_to(const InverseRanges& ranges, std::size_t i) noexcept {
  const double turn = ranges.turn(i - 1, i);
  const double s = std::abs(turn);
  const double c = ranges.cosine[i];
  const double n = ranges.sine[i];
  const double of_q = s * s * s / 3.0;
  const double of_both = 0.5 * s * turn;
  return {of_q * c * c - 2.0 * of_both * c * n + s * n * n,
          (of_q - s) * c * n + of_both * (c * c - n * n),
          of_q * n * n + 2.0 * of_both * c * n + s * c * c};
}

// The line through the first two returns, and what white noise of density 1 between them adds to
// its covariance: a third of the slope's.
struct Beginning {
  LineSums sums;
  LineFit line;
  Wander wander;
};

Beginning begin_at(const InverseRanges& ranges, std::size_t from) noexcept {
  Beginning beginning;
  ranges.add_to(beginning.sums, from);
  ranges.add_to(beginning.sums, from + 1);
  beginning.line = beginning.sums.solve();
  const double c = ranges.cosine[from + 1];
  const double n = ranges.sine[from + 1];
  const double of_slope = std::abs(ranges.turn(from, from + 1)) / 3.0;
  beginning.wander = {of_slope * n * n, -of_slope * c * n, of_slope * c * c};
  return beginning;
}

}  // namespace

void CurveFilter::begin(const InverseRanges& ranges, std::size_t from) {
  ranges_ = &ranges;
  next_ = from + 2;
  steps_ = 0;
  const double unit = unit_density(ranges, from);
  const auto [sums, line, wander] = begin_at(ranges, from);
  information_ = sums;
  first_information_ = sums.determinant();
  for (std::size_t k = 0; k < kStrengths; ++k) {
    density_[k] = unit * kStrength[k];
    p0_[k] = line.parameters[0];
    p1_[k] = line.parameters[1];
    p00_[k] = line.covariance(0, 0) + density_[k] * wander.p00;
    p01_[k] = line.covariance(0, 1) + density_[k] * wander.p01;
    p11_[k] = line.covariance(1, 1) + density_[k] * wander.p11;
    misfit_[k] = 0.0;
    product_[k] = 1.0;
    logarithm_[k] = 0.0;
  }
}

void CurveFilter::extend(std::size_t to) {
  for (; next_ < to; ++next_) {
    step(next_);
    if (++steps_ == kStepsPerLogarithm) take_logarithms();
  }
}

void CurveFilter::take_logarithms() {
  for (std::size_t k = 0; k < kStrengths; ++k) {
    logarithm_[k] += std::log(product_[k]);
    product_[k] = 1.0;
  }
  steps_ = 0;
}

// All strengths at once, so that the compiler makes vectors of them.
void CurveFilter::step(std::size_t i) {
  const Wander wander = wander_to(*ranges_, i);
  const double c = ranges_->cosine[i];
  const double n = ranges_->sine[i];
  const double q = ranges_->q[i];
  const double weight = ranges_->weight[i];
  information_.add(c, n, 0.0, weight);
  for (std::size_t k = 0; k < kStrengths; ++k) {
    const double p00 = p00_[k] + density_[k] * wander.p00;
    const double p01 = p01_[k] + density_[k] * wander.p01;
    const double p11 = p11_[k] + density_[k] * wander.p11;
    const double g0 = p00 * c + p01 * n;
    const double g1 = p01 * c + p11 * n;
    const double ratio = 1.0 + weight * (g0 * c + g1 * n);
    const double information = weight / ratio;
    const double e = q - (p0_[k] * c + p1_[k] * n);
    const double surprise = information * e;
    misfit_[k] += surprise * e;
    product_[k] *= ratio;
    p0_[k] += g0 * surprise;
    p1_[k] += g1 * surprise;
    p00_[k] = p00 - information * g0 * g0;
    p01_[k] = p01 - information * g0 * g1;
    p11_[k] = p11 - information * g1 * g1;
  }
}

CurveFilter::Best CurveFilter::best() const {
  const double of_line = std::log(information_.determinant() / first_information_);
  Lanes cost{};
  for (std::size_t k = 0; k < kStrengths; ++k)
    cost[k] = misfit_[k] + logarithm_[k] + std::log(product_[k]) - of_line;
  const auto least =
      static_cast<std::size_t>(std::min_element(cost.begin(), cost.end()) - cost.begin());
  Best best{kStrength[least], cost[least]};
  if (least == 0 || least + 1 == kStrengths) return best;
  const double left = cost[least - 1] - cost[least];
  const double right = cost[least + 1] - cost[least];
  const double shift = 0.5 * (left - right) / (left + right);  // In steps of the grid.
  best.strength *= std::pow(kStrength[1] / kStrength[0], shift);
  best.cost -= 0.25 * (left - right) * shift;
  return best;
}

CurveSmoother::Line CurveSmoother::filter(const InverseRanges& ranges, std::size_t from,
                                          std::size_t to) {
  const double density = density_;
  const Beginning beginning = begin_at(ranges, from);
  const LineFit& fit = beginning.line;
  const Line first{fit.parameters[0], fit.parameters[1],
                   fit.covariance(0, 0) + density * beginning.wander.p00,
                   fit.covariance(0, 1) + density * beginning.wander.p01,
                   fit.covariance(1, 1) + density * beginning.wander.p11};
  Line line = first;
  for (std::size_t i = from + 2; i < to; ++i) {
    const Wander wander = wander_to(ranges, i);
    const double c = ranges.cosine[i];
    const double n = ranges.sine[i];
    line.p00 += density * wander.p00;
    line.p01 += density * wander.p01;
    line.p11 += density * wander.p11;
    const double g0 = line.p00 * c + line.p01 * n;
    const double g1 = line.p01 * c + line.p11 * n;
    const double information = 1.0 / (g0 * c + g1 * n + 1.0 / ranges.weight[i]);
    const double surprise = information * (ranges.q[i] - (line.p0 * c + line.p1 * n));
    steps_[i - from] = {g0 * information, g1 * information, information, surprise};
    line.p0 += g0 * surprise;
    line.p1 += g1 * surprise;
    line.p00 -= information * g0 * g0;
    line.p01 -= information * g0 * g1;
    line.p11 -= information * g1 * g1;
  }
  end_ = line;
  return first;
}

// Bryson and Frazier's form (Bierman 1973): what all later elements say, as a gradient and a
// curvature of their misfit by the line, is carried backwards; no matrix is inverted.
const std::vector<CurveSmoother::Estimate>& CurveSmoother::smooth(const InverseRanges& ranges,
                                                                  std::size_t from, std::size_t to,
                                                                  double strength) {
  const std::size_t size = to - from;
  steps_.resize(std::max(steps_.size(), size));
  estimates_.resize(size);
  breaks_.resize(size);
  breaks_[0] = breaks_[1] = 0.0;
  density_ = strength * unit_density(ranges, from);
  const Line first = filter(ranges, from, to);
  double d0 = 0.0, d1 = 0.0;               // Gradient.
  double d00 = 0.0, d01 = 0.0, d11 = 0.0;  // Curvature.
  for (std::size_t i = size; i-- > 2;) {
    const Step& step = steps_[i];
    const double c = ranges.cosine[from + i];
    const double n = ranges.sine[from + i];
    const double variance = 1.0 / ranges.weight[from + i];
    const double m0 = d00 * step.gain0 + d01 * step.gain1;
    const double m1 = d01 * step.gain0 + d11 * step.gain1;
    const double of_later = step.gain0 * m0 + step.gain1 * m1;
    const double surprise = step.surprise + step.gain0 * d0 + step.gain1 * d1;
    const double known = step.gain0 * c + step.gain1 * n - variance * of_later;
    estimates_[i] = {ranges.q[from + i] - variance * surprise, variance * known};
    const double information = step.information + of_later;
    d0 -= c * surprise;
    d1 -= n * surprise;
    d00 += c * c * information - 2.0 * c * m0;
    d01 += c * n * information - c * m1 - n * m0;
    d11 += n * n * information - 2.0 * n * m1;
    const double determinant = d00 * d11 - d01 * d01;
    const bool is_determined = determinant > kSingular * d00 * d11;
    breaks_[i] =
        is_determined ? (d0 * d0 * d11 - 2.0 * d0 * d1 * d01 + d1 * d1 * d00) / determinant : 0.0;
  }
  take_begin(first, {d0, d1, d00, d01, d11});
  for (std::size_t i = 0; i < 2; ++i) {  // By the line that begins it.
    const double c = ranges.cosine[from + i];
    const double n = ranges.sine[from + i];
    estimates_[i] = {begin_.p0 * c + begin_.p1 * n,
                     begin_.p00 * c * c + 2.0 * begin_.p01 * c * n + begin_.p11 * n * n};
  }
  return estimates_;
}

// @param later  gradient and curvature, of what all later elements say.
void CurveSmoother::take_begin(const Line& first, const std::array<double, 5>& later) noexcept {
  const auto [d0, d1, d00, d01, d11] = later;
  const auto [p0, p1, p00, p01, p11] = first;
  // P - P D P.
  const double a0 = p00 * d00 + p01 * d01, a1 = p00 * d01 + p01 * d11;
  const double b0 = p01 * d00 + p11 * d01, b1 = p01 * d01 + p11 * d11;
  begin_ = {p0 - (p00 * d0 + p01 * d1), p1 - (p01 * d0 + p11 * d1),  //
            p00 - (a0 * p00 + a1 * p01), p01 - (a0 * p01 + a1 * p11), p11 - (b0 * p01 + b1 * p11)};
}

}  // namespace striper::detail
