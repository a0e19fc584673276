// SPDX-License-Identifier: Apache-2.0
#include "detect/curb/sparse_face.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <striper/core/units.hpp>

#include "profile/joints.hpp"
#include "profile/scan_line.hpp"

namespace striper::detail {
namespace {

// Squared misfit of what is on a line: three sigmas.
constexpr double kOn = 9.0;

// Faces lean by 20 degrees, and so few returns tell it to some 10.
const double kMostLean = std::sin(30.0 * kDegree);

// 1/range of the line through two elements is p . (cosine, sine); nothing where both are one ray.
std::optional<Eigen::Vector2d> through(const InverseRanges& ranges, std::size_t a, std::size_t b) {
  constexpr double kLeastTurn = 1e-9;
  const double turn = ranges.turn(a, b);
  if (std::abs(turn) < kLeastTurn) return std::nullopt;
  return Eigen::Vector2d(ranges.q[a] * ranges.sine[b] - ranges.q[b] * ranges.sine[a],
                         ranges.q[b] * ranges.cosine[a] - ranges.q[a] * ranges.cosine[b]) /
         turn;
}

}  // namespace

std::optional<ScanLine> SparseFace::find(const InverseRanges& ranges, std::size_t from,
                                         std::size_t to, const Eigen::Vector2d& up,
                                         std::size_t fewest) {
  if (to < from + fewest || to - from > kMost) return std::nullopt;
  double least = std::numeric_limits<double>::infinity();
  best_.clear();
  for (std::size_t a = from; a < to; ++a) {
    for (std::size_t b = a + 1; b < to; ++b) {
      const auto line = through(ranges, a, b);
      // The normal is along the parameters; a face's has next to nothing of `up`.
      if (!line || std::abs(line->dot(up)) > kMostLean * line->norm()) continue;
      const double misfit = truncated_misfit(ranges, from, to, *line);
      if (misfit >= least) continue;
      least = misfit;
      best_.swap(on_);
    }
  }
  if (best_.size() < fewest) return std::nullopt;
  const LineFit fit = fit_elements(ranges, best_);
  if (!fit.is_determined) return std::nullopt;
  return scan_line(fit, 1.0, ranges.pivot);
}

// And which elements are on the line.
double SparseFace::truncated_misfit(const InverseRanges& ranges, std::size_t from, std::size_t to,
                                    const Eigen::Vector2d& line) {
  double sum = 0.0;
  on_.clear();
  for (std::size_t i = from; i < to; ++i) {
    const double e = ranges.q[i] - line.x() * ranges.cosine[i] - line.y() * ranges.sine[i];
    const double misfit = e * e * ranges.weight[i];
    if (misfit < kOn) on_.push_back(i);
    sum += std::min(misfit, kOn);
  }
  return sum;
}

}  // namespace striper::detail
