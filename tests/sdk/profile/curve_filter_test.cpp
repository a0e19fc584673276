// SPDX-License-Identifier: Apache-2.0
// Proves that the curve's filter and smoother say of a wandering line what the dense Gaussian of
// all returns together says. That surfaces are such is not proven here.
#include "profile/shape/curve_filter.hpp"

#include <cmath>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "support/profile_scans.hpp"

namespace striper::detail {
namespace {

constexpr Eigen::Index kCount = 40;

InverseRanges wave_ranges() {
  testing::ProfileStriper striper;
  striper.columns = kCount;
  std::vector<double> exact;
  for (std::size_t i = 0; i < kCount; ++i)
    exact.push_back(1.5 + 8.0 * striper.sigma_m(i, 1.5) * std::sin(0.3 * static_cast<double>(i)));
  PolarScan scan;
  testing::noisy_scan(striper, exact, scan);
  InverseRanges ranges;
  ranges.take(scan, Eigen::Vector2d::Zero());
  return ranges;
}

Eigen::Vector2d ray(const InverseRanges& ranges, Eigen::Index i) {
  const auto at = static_cast<std::size_t>(i);
  return {ranges.cosine[at], ranges.sine[at]};
}

// White noise of the slope between two rays, in many small kicks.
Eigen::Matrix2d wander(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  constexpr int kKicks = 400;
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  for (int k = 0; k < kKicks; ++k) {
    const Eigen::Vector2d at = (from + (to - from) * (k + 0.5) / kKicks).normalized();
    const Eigen::Vector2d kick(-at.y(), at.x());
    sum += kick * kick.transpose() * (to - from).norm() / kKicks;
  }
  return sum;
}

// All returns from the second on, given the first two, as one Gaussian.
struct Dense {
  Eigen::VectorXd mean, q;
  Eigen::MatrixXd of_q;    // Covariance of the surface.
  Eigen::VectorXd weight;  // Of the noise; 0: was taken before.
  double of_line = 0.0;    // What it costs more than a line for what returns say of one.
};

Dense dense(const InverseRanges& ranges, double strength) {
  LineSums sums;
  ranges.add_to(sums, 0);
  ranges.add_to(sums, 1);
  const double first = sums.determinant();
  const LineFit line = sums.solve();
  const double spacing = (ray(ranges, 1) - ray(ranges, 0)).norm();
  const double density = strength / (ranges.weight[1] * spacing * spacing * spacing);
  const Eigen::Vector2d across(-ray(ranges, 1).y(), ray(ranges, 1).x());
  Dense out{Eigen::VectorXd(kCount), Eigen::VectorXd(kCount), Eigen::MatrixXd(kCount, kCount),
            Eigen::VectorXd::Zero(kCount)};
  Eigen::Matrix2d state = line.covariance + density * spacing / 3.0 * across * across.transpose();
  for (Eigen::Index i = 0; i < kCount; ++i) {
    if (i > 1) {
      state += density * wander(ray(ranges, i - 1), ray(ranges, i));
      ranges.add_to(sums, static_cast<std::size_t>(i));
      out.weight[i] = ranges.weight[static_cast<std::size_t>(i)];
    }
    out.q[i] = ranges.q[static_cast<std::size_t>(i)];
    out.mean[i] = line.parameters.dot(ray(ranges, i));
    for (Eigen::Index j = i; j < kCount; ++j)  // Later lines wander on from this one.
      out.of_q(i, j) = out.of_q(j, i) = ray(ranges, i).dot(state * ray(ranges, j));
  }
  out.of_line = std::log(sums.determinant() / first);
  return out;
}

TEST(CurveSmoother, IsTheDenseGaussian) {
  const InverseRanges ranges = wave_ranges();
  for (const double strength : {1e-6, 1e-3, 1.0}) {
    const Dense d = dense(ranges, strength);
    const Eigen::MatrixXd weight = d.weight.asDiagonal();
    const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(kCount, kCount);
    const Eigen::MatrixXd posterior =
        (identity + d.of_q * weight).partialPivLu().solve(d.of_q).eval();
    const Eigen::VectorXd estimate = d.mean + posterior * weight * (d.q - d.mean);
    CurveSmoother smoother;
    const auto& got = smoother.smooth(ranges, 0, kCount, strength);
    for (Eigen::Index i = 0; i < kCount; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const double sigma = std::sqrt(posterior(i, i));
      EXPECT_NEAR(got[at].q, estimate[i], 1e-4 * sigma) << strength << " " << i;
      EXPECT_NEAR(std::sqrt(got[at].variance), sigma, 1e-4 * sigma) << strength << " " << i;
    }
  }
}

TEST(CurveFilter, ItsCostIsTheLikelihoodOfTheDenseGaussian) {
  const InverseRanges ranges = wave_ranges();
  double least = 1e9;
  for (const double strength : CurveFilter::kStrength) {
    const Dense d = dense(ranges, strength);
    const Eigen::Index n = kCount - 2;
    const Eigen::VectorXd w = d.weight.tail(n);
    const Eigen::MatrixXd inverse_noise = w.asDiagonal();
    const Eigen::MatrixXd noise = w.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd spread = d.of_q.bottomRightCorner(n, n) + noise;
    const Eigen::VectorXd e = (d.q - d.mean).tail(n);
    const double growth = std::log((spread * inverse_noise).determinant());
    least = std::min(least, e.dot(spread.ldlt().solve(e)) + growth - d.of_line);
  }
  CurveFilter filter;
  filter.begin(ranges, 0);
  filter.extend(kCount / 2);
  filter.extend(kCount);
  const CurveFilter::Best best = filter.best();
  EXPECT_NEAR(best.cost, least, 1e-3);
  EXPECT_EQ(best.strength, 1.0);  // The last of the grid: no parabola beyond it.
}

TEST(CurveFilter, AStraightLineCostsItsChi2) {
  testing::ProfileStriper striper;
  PolarScan scan;
  testing::noisy_scan(striper, std::vector<double>(640, 1.5), scan);
  InverseRanges ranges;
  ranges.take(scan, Eigen::Vector2d::Zero());
  LineSums sums;
  for (std::size_t i = 0; i < 20; ++i) ranges.add_rotated(sums, i, 10);
  CurveFilter filter;
  filter.begin(ranges, 0);
  filter.extend(20);  // Too few for the least strength to bend.
  EXPECT_NEAR(filter.best().cost, sums.chi2(), 1.0);
}

}  // namespace
}  // namespace striper::detail
