// SPDX-License-Identifier: Apache-2.0
#include "profile/circle_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace striper::detail {
namespace {

constexpr std::size_t kFewest = 5;  // Three for the circle, two that say whether there is one.
constexpr int kMostSteps = 12;
// A step of less than this part of a sigma in any direction, squared, is the last: the next one
// would be of its square.
constexpr double kSmallStep2 = 1e-4;
// Flatter than this over its chord a circle is a line: the sagitta is then 1e-7 of the chord.
constexpr double kFlattest = 1e-7;
constexpr double kLeastFacing = 0.05;  // The sine of 3 degrees.

using Coefficients = Eigen::Vector3d;  // a, b, d.

// The chord of an arc: its middle, its direction and half its length, which is the unit of lengths.
struct Chord {
  Eigen::Vector2d middle;
  Eigen::Vector2d along;
  Eigen::Vector2d across;  // Away from the pivot.
  double half_m;
};

Eigen::Vector2d from_pivot(const InverseRanges& ranges, std::size_t i) noexcept {
  return Eigen::Vector2d(ranges.cosine[i], ranges.sine[i]) / ranges.q[i];
}

Chord chord_of(const InverseRanges& ranges, std::span<const std::size_t> elements) noexcept {
  const Eigen::Vector2d first = from_pivot(ranges, elements.front());
  const Eigen::Vector2d last = from_pivot(ranges, elements.back());
  Chord chord{0.5 * (first + last), (last - first).normalized(), {}, 0.5 * (last - first).norm()};
  chord.across = {-chord.along.y(), chord.along.x()};
  if (chord.across.dot(chord.middle) < 0.0) chord.across = -chord.across;
  return chord;
}

// How steep the equation is across the circle: the same all around it.
double gradient_of(const Coefficients& abd) noexcept {
  return std::sqrt(std::max(abd[1] * abd[1] + 1.0 - 4.0 * abd[0] * abd[2], 0.0));
}

// A return and the circle.
struct Term {
  double e;        // How far it lies beyond the circle, along its ray.
  Coefficients d;  // Of the circle's place on the ray, less: by the coefficients.
  double weight;
};

// The circle is where F - F_r s + a s^2 = 0, s before the return; F grows outwards.
Term term_of(const InverseRanges& ranges, std::size_t i, const Chord& chord,
             const Coefficients& abd) noexcept {
  const Eigen::Vector2d ray(ranges.cosine[i], ranges.sine[i]);
  const double q = ranges.q[i] * chord.half_m;
  const Eigen::Vector2d p = ray / q - chord.middle / chord.half_m;
  const double t = chord.along.dot(p);
  const double m = chord.across.dot(p);
  const double by_t = 2.0 * abd[0] * t + abd[1];
  const double by_m = 2.0 * abd[0] * m + 1.0;
  const double value = abd[0] * (t * t + m * m) + abd[1] * t + m + abd[2];
  const double outwards = by_t * chord.along.dot(ray) + by_m * chord.across.dot(ray);
  const double root2 = outwards * outwards - 4.0 * abd[0] * value;
  const double least = kLeastFacing * gradient_of(abd);
  const double facing = std::max(std::sqrt(std::max(root2, 0.0)), least);
  Term term;
  term.e = 2.0 * value / (std::max(outwards, facing) + facing);
  const Eigen::Vector2d on = p - term.e * ray;
  term.d = Coefficients(on.squaredNorm(), chord.along.dot(on), 1.0) / facing;
  const double by_q = ranges.q[i] * q;  // dq is by_q times what is along the ray.
  term.weight = ranges.weight[i] * by_q * by_q;
  return term;
}

// Of a circle; zero, which is the chord itself, where its middle is not before or behind the chord.
Coefficients coefficients_of(const CircleFit& circle, const Eigen::Vector2d& pivot,
                             const Chord& chord) noexcept {
  const Eigen::Vector2d centre = (circle.centre_m - pivot - chord.middle) / chord.half_m;
  const double behind = chord.across.dot(centre);
  if (!circle.is_determined || !(circle.is_hollow ? behind < 0.0 : behind > 0.0)) return {0, 0, 0};
  const double a = -0.5 / behind;
  const double b = -2.0 * a * chord.along.dot(centre);
  const double radius = circle.radius_m / chord.half_m;
  return {a, b, (b * b + 1.0) / (4.0 * a) - a * radius * radius};
}

// Centre and radius of the coefficients, with their covariance.
void put_circle(const Eigen::Vector2d& pivot, const Chord& chord, const Coefficients& abd,
                const Eigen::Matrix3d& covariance, CircleFit& fit) noexcept {
  const auto [a, b, d] = std::array{abd[0], abd[1], abd[2]};
  const double gradient = gradient_of(abd);
  const double sign = a > 0.0 ? 1.0 : -1.0;
  const Eigen::Vector2d centre = (-b * chord.along - chord.across) / (2.0 * a);
  fit.centre_m = pivot + chord.middle + chord.half_m * centre;
  fit.radius_m = chord.half_m * gradient / (2.0 * std::abs(a));
  fit.is_hollow = a > 0.0;
  Eigen::Matrix3d by;
  by.block<2, 1>(0, 0) = -centre / a;
  by.block<2, 1>(0, 1) = -chord.along / (2.0 * a);
  by.block<2, 1>(0, 2).setZero();
  by.row(2) << -sign * (d / (a * gradient) + gradient / (2.0 * a * a)),
      sign * b / (2.0 * a * gradient), -sign / gradient;
  by *= chord.half_m;
  fit.covariance = by * covariance * by.transpose();
}

}  // namespace

CircleFit fit_circle(const InverseRanges& ranges, std::span<const std::size_t> elements,
                     const CircleFit& start) noexcept {
  CircleFit fit;
  fit.points = static_cast<int>(elements.size());
  if (elements.size() < kFewest) return fit;
  const Chord chord = chord_of(ranges, elements);
  if (!(chord.half_m > 0.0)) return fit;
  Coefficients abd = coefficients_of(start, ranges.pivot, chord);
  for (int step = 0; step < kMostSteps; ++step) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Coefficients right = Coefficients::Zero();
    fit.chi2 = 0.0;
    for (const std::size_t i : elements) {
      const Term term = term_of(ranges, i, chord, abd);
      normal += term.weight * term.d * term.d.transpose();
      right -= term.weight * term.e * term.d;
      fit.chi2 += term.weight * term.e * term.e;
    }
    const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
    const Coefficients change = solver.solve(right);
    if (!change.allFinite() || !(solver.vectorD().minCoeff() > 0.0)) return fit;
    abd += change;
    if (!(gradient_of(abd) > 0.0)) return fit;
    if (change.dot(normal * change) > kSmallStep2) continue;
    if (std::abs(abd[0]) < kFlattest) return fit;
    put_circle(ranges.pivot, chord, abd, normal.inverse(), fit);
    fit.is_determined = true;
    return fit;
  }
  return fit;
}

double misfit(const InverseRanges& ranges, std::size_t i, const CircleFit& circle) noexcept {
  const Eigen::Vector2d ray(ranges.cosine[i], ranges.sine[i]);
  const Eigen::Vector2d centre = circle.centre_m - ranges.pivot;
  const double along = centre.dot(ray);
  const double root2 = along * along - centre.squaredNorm() + circle.radius_m * circle.radius_m;
  const double root = std::sqrt(std::max(root2, 0.0));
  const double beyond = 1.0 / ranges.q[i] - (circle.is_hollow ? along + root : along - root);
  const double missed = root2 < 0.0 ? std::sqrt(-root2) : 0.0;
  return (std::abs(beyond) + missed) * ranges.q[i] * ranges.q[i] * std::sqrt(ranges.weight[i]);
}

// On the circle n . d(point) = n . d(centre) + d(radius), n outwards.
OnCircle on_circle(const InverseRanges& ranges, std::size_t i, const CircleFit& circle) noexcept {
  const Eigen::Vector2d ray(ranges.cosine[i], ranges.sine[i]);
  const Eigen::Vector2d centre = circle.centre_m - ranges.pivot;
  const double along = centre.dot(ray);
  const double root =
      std::sqrt(along * along - centre.squaredNorm() + circle.radius_m * circle.radius_m);
  const double distance = circle.is_hollow ? along + root : along - root;
  const Eigen::Vector2d n = (distance * ray - centre) / circle.radius_m;
  const double facing = std::max(std::abs(n.dot(ray)), kLeastFacing);
  const Eigen::Vector3d by(n.x(), n.y(), 1.0);
  const double q = 1.0 / distance;
  return {q, by.dot(circle.covariance * by) * std::pow(q * q / facing, 2.0)};
}

}  // namespace striper::detail
