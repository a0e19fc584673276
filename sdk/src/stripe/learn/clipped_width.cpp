// SPDX-License-Identifier: Apache-2.0
#include "stripe/learn/clipped_width.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

constexpr double kWindowReach = 6.0;  // Widths on either side.
constexpr int kMostSteps = 6;
constexpr int kLeastPixels = 8;
constexpr double kSettled = 0.01;  // Of the width.

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

enum { kPosition, kAmplitude, kWidth, kBackground, kSlope };

struct Normal {
  Matrix5 matrix = Matrix5::Zero();
  Vector5 right = Vector5::Zero();
  int pixels = 0;
};

template <typename Pixel>
Normal normal_equations(const LitLine<Pixel>& line, const Vector5& p, double centre, int reach) {
  Normal normal;
  const int middle = static_cast<int>(std::lround(centre));
  const int first = std::max(0, middle - reach);
  const int last = std::min(line.length() - 1, middle + reach);
  for (int k = first; k <= last; ++k) {
    if (line.clipped(k) || line.masked(k)) continue;
    const double t = (k - p[kPosition]) / p[kWidth];
    const double g = std::exp(-0.5 * t * t);
    const double a = p[kAmplitude] * g / p[kWidth];
    Vector5 gradient;
    gradient << a * t, g, a * t * t, 1.0, k - centre;
    const double model = p[kAmplitude] * g + p[kBackground] + p[kSlope] * (k - centre);
    normal.matrix += gradient * gradient.transpose();
    normal.right += gradient * (line.value(k) - model);
    ++normal.pixels;
  }
  return normal;
}

template <typename Pixel>
std::optional<double> fit(const LitLine<Pixel>& line, const ClippedProfile& guess) {
  Vector5 p;
  p << guess.position, guess.amplitude, guess.width, 0.0, 0.0;
  const int reach = static_cast<int>(std::ceil(kWindowReach * guess.width)) + 2;
  for (int step = 0; step < kMostSteps; ++step) {
    const Normal normal = normal_equations(line, p, guess.position, reach);
    if (normal.pixels < kLeastPixels) return std::nullopt;
    const Eigen::LDLT<Matrix5> factors(normal.matrix);
    if (!factors.isPositive()) return std::nullopt;
    const Vector5 change = factors.solve(normal.right);
    if (!change.allFinite()) return std::nullopt;
    const double longest = 0.3 * p[kWidth];
    p[kPosition] += std::clamp(change[kPosition], -longest, longest);
    const double width_change = std::clamp(change[kWidth], -longest, longest);
    p[kWidth] += width_change;
    p[kAmplitude] = std::max(1.0, p[kAmplitude] + change[kAmplitude]);
    p[kBackground] += change[kBackground];
    p[kSlope] += change[kSlope];
    if (std::abs(width_change) < kSettled * p[kWidth]) return p[kWidth];
  }
  return std::nullopt;
}

}  // namespace

std::optional<double> fit_clipped_width(const LitFrame& frame, StripeAxis axis,
                                        const ClippedProfile& guess) {
  if (frame.lit.depth() == CV_8U) {
    return fit(LitLine<std::uint8_t>(frame, axis, guess.line), guess);
  }
  return fit(LitLine<std::uint16_t>(frame, axis, guess.line), guess);
}

}  // namespace striper::detail
