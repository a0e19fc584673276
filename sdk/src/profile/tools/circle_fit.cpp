// SPDX-License-Identifier: Apache-2.0
#include "profile/tools/circle_fit.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <striper/core/robust.hpp>

#include "profile/tools/patch.hpp"

namespace striper::detail {
namespace {

constexpr std::size_t kFewest = 5;  // Three for the circle, two that say whether there is one.
constexpr int kSteps = 20;
constexpr double kSmallStep = 1e-9;  // Of the radius.
// The weight of a return at grazing incidence is that of one at 80 degrees at most: beyond, the
// projected noise is of second order and the surface seldom what it seems.
constexpr double kLeastFacing2 = 0.03;
constexpr double kGateSigmas = 5.0;
constexpr int kTrims = 2;

struct Term {
  double e;           // Distance beyond the circle, m.
  Eigen::Vector3d d;  // By centre and radius.
  double variance;    // Of e.
  double weight;
};

Term term_of(const InverseRanges& ranges, std::size_t i, const Eigen::Vector3d& circle) {
  const Eigen::Vector2d v(ranges.cosine[i], ranges.sine[i]);
  const Eigen::Vector2d from_centre = point_of(ranges, i) - circle.head<2>();
  const double distance = from_centre.norm();
  const Eigen::Vector2d n = from_centre / distance;
  const double q2 = ranges.q[i] * ranges.q[i];
  const double along_ray = 1.0 / (ranges.weight[i] * q2 * q2);
  const double facing2 = n.dot(v) * n.dot(v);
  Term term;
  // Noise across the radius makes every distance longer: its mean is taken off.
  term.e = distance - circle[2] - 0.5 * along_ray * (1.0 - facing2) / distance;
  term.d << -n, -1.0;
  term.variance = along_ray * facing2;
  term.weight = 1.0 / (along_ray * std::max(facing2, kLeastFacing2));
  return term;
}

// x^2 + y^2 = 2 a x + 2 b y + c, about the mean.
std::optional<Eigen::Vector3d> algebraic(const InverseRanges& ranges,
                                         const std::vector<std::size_t>& elements) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const std::size_t i : elements)
    mean += point_of(ranges, i) / static_cast<double>(elements.size());
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const std::size_t i : elements) {
    const Eigen::Vector2d p = point_of(ranges, i) - mean;
    const Eigen::Vector3d row(2.0 * p.x(), 2.0 * p.y(), 1.0);
    normal += row * row.transpose();
    right += row * p.squaredNorm();
  }
  const Eigen::Vector3d abc = normal.ldlt().solve(right);
  const double radius2 = abc[2] + abc.head<2>().squaredNorm();
  if (!abc.allFinite() || !(radius2 > 0.0)) return std::nullopt;
  return Eigen::Vector3d(abc[0] + mean.x(), abc[1] + mean.y(), std::sqrt(radius2));
}

// Gauss and Newton's steps from `circle` on.
CircleFit refine(const InverseRanges& ranges, const std::vector<std::size_t>& elements,
                 Eigen::Vector3d circle) {
  CircleFit fit;
  fit.points = static_cast<int>(elements.size());
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double chi2 = 0.0;
    for (const std::size_t i : elements) {
      const Term term = term_of(ranges, i, circle);
      normal += term.weight * term.d * term.d.transpose();
      noise += term.weight * term.weight * term.variance * term.d * term.d.transpose();
      right -= term.weight * term.e * term.d;
      chi2 += term.weight * term.e * term.e;
    }
    const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
    const Eigen::Vector3d change = solver.solve(right);
    if (!change.allFinite() || !(solver.vectorD().minCoeff() > 0.0)) return fit;
    circle += change;
    if (!(circle[2] > 0.0)) return fit;
    if (change.norm() > kSmallStep * circle[2]) continue;
    const double scale = scatter_scale(chi2, fit.points - 3);
    const Eigen::Matrix3d inverse = normal.inverse();
    fit.parameters = circle;
    fit.covariance = scale * scale * inverse * noise * inverse;
    fit.is_determined = true;
    return fit;
  }
  return fit;
}

// Leaves out what is far off for the scatter; whether there was any.
bool trim(const InverseRanges& ranges, const Eigen::Vector3d& circle,
          std::vector<std::size_t>& elements) {
  std::vector<double> sigmas;
  for (const std::size_t i : elements) {
    const Term term = term_of(ranges, i, circle);
    sigmas.push_back(std::abs(term.e) * std::sqrt(term.weight));
  }
  std::vector<double> sorted = sigmas;
  const double gate = kGateSigmas * std::max(1.0, kSigmaOfMedianAbsolute * upper_median(sorted));
  std::size_t kept = 0;
  for (std::size_t k = 0; k < elements.size(); ++k)
    if (sigmas[k] <= gate) elements[kept++] = elements[k];
  const bool is_trimmed = kept < elements.size();
  elements.resize(kept);
  return is_trimmed;
}

}  // namespace

CircleFit fit_circle(const InverseRanges& ranges, std::vector<std::size_t> elements) {
  CircleFit fit;
  for (int round = 0; round <= kTrims; ++round) {
    if (elements.size() < kFewest) return {};
    const auto start = algebraic(ranges, elements);
    if (!start) return {};
    fit = refine(ranges, elements, *start);
    if (!fit.is_determined || round == kTrims || !trim(ranges, fit.parameters, elements)) break;
  }
  return fit;
}

}  // namespace striper::detail
