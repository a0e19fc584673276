// SPDX-License-Identifier: Apache-2.0
#include "profile/surface_edge.hpp"

#include <cmath>

#include "profile/edge_columns.hpp"

namespace striper::detail {

SurfaceEdge edge_beyond(const InverseRanges& ranges, const LineFit& fit, std::size_t from,
                        std::size_t to, bool is_end) noexcept {
  const float half_bright = 0.5F * brightness_inside(ranges, from, to, is_end);
  const std::size_t outermost = is_end ? to - 1 : from;
  const auto inwards = [&](std::size_t i) { return is_end ? i - 1 : i + 1; };
  std::size_t outer = outermost;
  for (int dim = 0; dim < kMostMixed && ranges.intensity[outer] < half_bright; ++dim)
    outer = inwards(outer);
  InverseRanges::Beyond beyond;
  if (half_bright > 0.0F && outer == outermost)
    beyond = ranges.beyond(outer, is_end, half_bright, kMostMixed);
  const Eigen::Vector2d v(ranges.cosine[outer], ranges.sine[outer]);
  const double spacing = ranges.turn(inwards(outer), outer);
  const double half = 0.5 * (1 + beyond.mixed) * spacing;
  SurfaceEdge edge;
  const double further = half + beyond.part_seen * spacing;
  edge.direction = (v + further * Eigen::Vector2d(-v.y(), v.x())).normalized();
  edge.q = fit.parameters.dot(edge.direction);
  const double slope = fit.parameters.dot(Eigen::Vector2d(-edge.direction.y(), edge.direction.x()));
  const double per_radian = std::hypot(edge.q, slope) / (edge.q * edge.q);  // Metres on the line.
  edge.at_m = ranges.pivot + edge.direction / edge.q;
  edge.sigma_m = 2.0 * std::abs(half) * per_radian / std::sqrt(12.0);
  return edge;
}

}  // namespace striper::detail
