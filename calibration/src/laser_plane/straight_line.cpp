// SPDX-License-Identifier: Apache-2.0
#include "laser_plane/straight_line.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <striper/core/robust.hpp>
#include <striper/geometry/line_fit.hpp>

namespace striper::detail {
namespace {

constexpr int kTrials = 300;
constexpr std::size_t kFewest = 8;

double distance(const StraightLine& line, const Eigen::Vector2d& p) {
  return std::abs(p.y() - line.at(p.x()));
}

// The value that a fraction of the distances stays below. Less than a half, so that a line holds
// out against a majority of returns elsewhere.
double quantile_distance(const StraightLine& line, const std::vector<Eigen::Vector2d>& points,
                         double fraction) {
  std::vector<double> distances;
  distances.reserve(points.size());
  for (const auto& p : points) distances.push_back(distance(line, p));
  const double last = static_cast<double>(points.size() - 1);
  return nth_smallest(distances, static_cast<std::size_t>(fraction * last));
}

void collect(const std::vector<Eigen::Vector2d>& points, double gate, StraightLine& line) {
  line.inliers.clear();
  for (std::size_t i = 0; i < points.size(); ++i)
    if (distance(line, points[i]) <= gate) line.inliers.push_back(i);
}

void least_squares(const std::vector<Eigen::Vector2d>& points, StraightLine& line) {
  // About one of them, so that the sums keep their digits.
  const Eigen::Vector2d& about = points[line.inliers[line.inliers.size() / 2]];
  LineSums sums;
  for (const std::size_t i : line.inliers)
    sums.add(1.0, points[i].x() - about.x(), points[i].y() - about.y(), 1.0);
  const LineFit fit = sums.solve();
  line.slope = fit.parameters[1];
  line.offset = about.y() + fit.parameters[0] - line.slope * about.x();
  double sum = 0.0;
  for (const std::size_t i : line.inliers) sum += std::pow(distance(line, points[i]), 2);
  line.rms = std::sqrt(sum / std::max(fit.dof(), 1));
}

}  // namespace

std::optional<StraightLine> fit_line(const std::vector<Eigen::Vector2d>& points,
                                     double least_gate) {
  if (points.size() < kFewest) return std::nullopt;
  std::mt19937 generator(1984);  // NOLINT: the same draws every time is what is wanted.
  StraightLine best;
  double best_distance = std::numeric_limits<double>::infinity();
  for (int trial = 0; trial < kTrials; ++trial) {
    const Eigen::Vector2d& a = points[generator() % points.size()];
    const Eigen::Vector2d& b = points[generator() % points.size()];
    if (std::abs(b.x() - a.x()) < 5.0) continue;
    StraightLine line;
    line.slope = (b.y() - a.y()) / (b.x() - a.x());
    line.offset = a.y() - line.slope * a.x();
    const double d = quantile_distance(line, points, 0.4);
    if (d < best_distance) best_distance = d, best = line;
  }
  if (!std::isfinite(best_distance)) return std::nullopt;
  // The 40 % quantile of |normal| is 0.524 sigma.
  double gate = std::max(least_gate, 3.0 * best_distance / 0.524);
  for (int round = 0; round < 3; ++round) {
    collect(points, gate, best);
    if (best.inliers.size() < kFewest) return std::nullopt;
    least_squares(points, best);
    std::vector<double> distances;
    for (const std::size_t i : best.inliers) distances.push_back(distance(best, points[i]));
    gate = std::max(least_gate, 3.5 * robust_sigma(distances));
  }
  return best;
}

}  // namespace striper::detail
