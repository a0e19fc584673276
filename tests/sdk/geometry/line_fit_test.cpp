// SPDX-License-Identifier: Apache-2.0
// Proves that the line fit is the least squares solution (against a dense solver), that its
// covariance is what scatter gives, and that points at one place are no line.
#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <striper/geometry/line_fit.hpp>

#include "support/random.hpp"

namespace striper {
namespace {

TEST(LineFit, IsTheDenseLeastSquaresSolution) {
  constexpr int kPoints = 9;
  Eigen::Matrix<double, kPoints, 2> a;
  Eigen::Matrix<double, kPoints, 1> z;
  LineSums sums;
  for (int i = 0; i < kPoints; ++i) {
    const double weight = testing::uniform(0.5, 2.0);
    const Eigen::Vector2d f(testing::uniform(-1.0, 1.0), testing::uniform(-1.0, 1.0));
    const double value = testing::normal();
    sums.add(f.x(), f.y(), value, weight);
    a.row(i) = std::sqrt(weight) * f.transpose();
    z[i] = std::sqrt(weight) * value;
  }
  const LineFit fit = sums.solve();
  const Eigen::Vector2d exact = a.colPivHouseholderQr().solve(z);
  ASSERT_TRUE(fit.is_determined);
  EXPECT_EQ(fit.dof(), kPoints - 2);
  EXPECT_LT((fit.parameters - exact).norm(), 1e-12);
  EXPECT_NEAR(fit.chi2, (z - a * exact).squaredNorm(), 1e-11);
  EXPECT_NEAR(sums.chi2(), fit.chi2, 1e-11);
  EXPECT_LT((fit.covariance - (a.transpose() * a).inverse()).norm(), 1e-12);
}

TEST(LineFit, ScattersAsItsCovarianceSays) {
  constexpr int kTrials = 4000;
  double squares = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    LineSums sums;
    for (int i = 0; i < 12; ++i) {
      const double sigma = 0.1 + 0.05 * i;
      sums.add(1.0, i, 2.0 - 0.3 * i + testing::normal(0.0, sigma), 1.0 / (sigma * sigma));
    }
    const LineFit fit = sums.solve();
    const double error = fit.at(1.0, 20.0) - (2.0 - 0.3 * 20.0);
    squares += error * error / fit.variance_at(1.0, 20.0) / kTrials;
  }
  EXPECT_NEAR(squares, 1.0, 0.08);  // 3.5 sigmas of 4000 squares.
}

TEST(LineFit, PointsAtOnePlaceAreNoLine) {
  LineSums sums;
  for (int i = 0; i < 5; ++i) sums.add(0.3, 0.7, i, 1.0);
  EXPECT_FALSE(sums.solve().is_determined);
  EXPECT_EQ(sums.chi2(), 0.0);
}

}  // namespace
}  // namespace striper
