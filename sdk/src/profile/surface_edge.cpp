// SPDX-License-Identifier: Apache-2.0
#include "profile/surface_edge.hpp"

#include <cmath>

namespace striper::detail {

SurfaceEdge edge_beyond(const InverseRanges& ranges, const LineFit& fit, std::size_t outer,
                        std::size_t inner) noexcept {
  const Eigen::Vector2d v(ranges.cosine[outer], ranges.sine[outer]);
  const double half = 0.5 * ranges.turn(inner, outer);
  SurfaceEdge edge;
  edge.direction = (v + half * Eigen::Vector2d(-v.y(), v.x())).normalized();
  edge.q = fit.parameters.dot(edge.direction);
  const double slope = fit.parameters.dot(Eigen::Vector2d(-edge.direction.y(), edge.direction.x()));
  const double per_radian = std::hypot(edge.q, slope) / (edge.q * edge.q);  // Metres on the line.
  edge.at_m = ranges.pivot + edge.direction / edge.q;
  edge.sigma_m = 2.0 * std::abs(half) * per_radian / std::sqrt(12.0);
  return edge;
}

}  // namespace striper::detail
