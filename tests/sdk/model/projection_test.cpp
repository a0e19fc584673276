// SPDX-License-Identifier: Apache-2.0
// Proves that the lens formulas give with numbers that carry derivatives what they give with plain
// ones, and the right derivatives, the optical axis of an equidistant lens included, where the
// formula itself is 0 / 0. That they are OpenCV's lenses is proved with CameraModel.
#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>
#include <unsupported/Eigen/AutoDiff>

#include <striper/model/projection.hpp>

#include "support/random.hpp"

namespace striper {
namespace {

using Derived = Eigen::AutoDiffScalar<Eigen::Vector2d>;
using DerivedPoint = Eigen::Matrix<Derived, 2, 1>;

struct Lens {
  LensModel model;
  std::vector<double> k;
};

const std::vector<Lens> kLenses{
    {LensModel::kPlumbBob, {-0.25, 0.08, 1e-3, -5e-4, -0.01}},
    {LensModel::kRationalPolynomial, {0.4, 0.05, 2e-4, 3e-4, 0.01, 0.7, 0.1, 0.01}},
    {LensModel::kEquidistant, {-0.02, 0.004, -1e-3, 1e-4}},
};

DerivedPoint derived(const Lens& lens, const Eigen::Vector2d& xy) {
  const std::vector<Derived> k(lens.k.begin(), lens.k.end());
  return distort(lens.model, k.data(), DerivedPoint(Derived(xy.x(), 2, 0), Derived(xy.y(), 2, 1)));
}

Eigen::Vector2d plain(const Lens& lens, const Eigen::Vector2d& xy) {
  return distort(lens.model, lens.k.data(), xy);
}

TEST(Distort, DerivativesAreThoseOfDifferences) {
  constexpr double kStep = 1e-6;
  for (const Lens& lens : kLenses) {
    for (int trial = 0; trial < 50; ++trial) {
      const Eigen::Vector2d xy(testing::uniform(-0.6, 0.6), testing::uniform(-0.6, 0.6));
      const DerivedPoint there = derived(lens, xy);
      for (int axis = 0; axis < 2; ++axis) {
        EXPECT_EQ(there[axis].value(), plain(lens, xy)[axis]);
        const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(axis);
        const Eigen::Vector2d slope =
            (plain(lens, xy + step) - plain(lens, xy - step)) / (2.0 * kStep);
        EXPECT_NEAR(there.x().derivatives()[axis], slope.x(), 1e-9);
        EXPECT_NEAR(there.y().derivatives()[axis], slope.y(), 1e-9);
      }
    }
  }
}

TEST(Distort, OnTheAxisAPointStaysAndItsDerivativeIsTheIdentity) {
  for (const Lens& lens : kLenses) {
    const DerivedPoint there = derived(lens, Eigen::Vector2d::Zero());
    for (int axis = 0; axis < 2; ++axis) {
      EXPECT_EQ(there[axis].value(), 0.0);
      EXPECT_EQ(there[axis].derivatives(), Eigen::Vector2d(Eigen::Vector2d::Unit(axis)));
    }
  }
}

// Either side of the place where the series takes over from the arc tangent.
TEST(Distort, NearTheAxisAnEquidistantLensIsWhatItIsElsewhere) {
  const Lens& lens = kLenses[2];
  for (const double r : {1e-7, 0.9e-4, 0.999999e-4, 1.000001e-4, 1.1e-4, 1e-3}) {
    const double theta = std::atan(r);
    const double expected =
        theta * (1.0 + lens.k[0] * theta * theta + lens.k[1] * std::pow(theta, 4) +
                 lens.k[2] * std::pow(theta, 6));
    EXPECT_NEAR(plain(lens, {0.6 * r, 0.8 * r}).norm() / expected, 1.0, 4e-16) << r;
  }
}

}  // namespace
}  // namespace striper
