// SPDX-License-Identifier: Apache-2.0
#include "detect/curb/sparse_face.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <striper/core/units.hpp>

#include "detect/curb/curb_lines.hpp"
#include "profile/joints.hpp"
#include "profile/scan_line.hpp"

namespace striper::detail {
namespace {

// Squared misfit of what is on a line: three sigmas.
constexpr double kOn = 9.0;
constexpr std::size_t kFewest = 3;

// Faces lean by 20 degrees, and a line through two returns tells it to some 10.
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
                                         std::size_t to, const Known& known) {
  if (to < from + kFewest || to - from > kMost) return std::nullopt;
  judge_otherwise(ranges, from, to, known);
  double least = std::numeric_limits<double>::infinity();
  if (known.face != nullptr)
    least = misfit_of_all(ranges, from, parameters_of(*known.face, ranges.pivot));
  best_.clear();
  for (std::size_t a = from; a < to; ++a) {
    for (std::size_t b = a + 1; b < to; ++b) {
      const auto line = through(ranges, a, b);
      // The parameters are along the line's normal; a face's has next to nothing of the road's.
      if (!line || std::abs(line->dot(known.road->normal())) > kMostLean * line->norm()) continue;
      const double sum = misfit_of_all(ranges, from, *line);
      if (sum >= least) continue;
      least = sum;
      best_.swap(on_);
    }
  }
  const auto unexplained = std::count(otherwise_.begin(), otherwise_.end(), kOn);
  if (best_.size() < kFewest || 2 * std::ssize(best_) < unexplained) return std::nullopt;
  const LineFit fit = fit_elements(ranges, best_);
  if (!fit.is_determined) return std::nullopt;
  return scan_line(fit, 1.0, ranges.pivot);
}

// On the road, on the top, or speckle.
void SparseFace::judge_otherwise(const InverseRanges& ranges, std::size_t from, std::size_t to,
                                 const Known& known) {
  const Eigen::Vector2d road = parameters_of(*known.road, ranges.pivot);
  const Eigen::Vector2d top = parameters_of(*known.top, ranges.pivot);
  otherwise_.clear();
  for (std::size_t i = from; i < to; ++i)
    otherwise_.push_back(std::min({ranges.misfit(i, road), ranges.misfit(i, top), kOn}));
}

// And which elements are on the line.
double SparseFace::misfit_of_all(const InverseRanges& ranges, std::size_t from,
                                 const Eigen::Vector2d& parameters) {
  double sum = 0.0;
  on_.clear();
  for (std::size_t k = 0; k < otherwise_.size(); ++k) {
    const double on_face = ranges.misfit(from + k, parameters);
    if (on_face < otherwise_[k]) on_.push_back(from + k);
    sum += std::min(on_face, otherwise_[k]);
  }
  return sum;
}

}  // namespace striper::detail
