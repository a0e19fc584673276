// SPDX-License-Identifier: Apache-2.0
// Proves that small systems are solved as Eigen solves them, and that what is not positive definite
// is told.
#include "core/small_ldlt.hpp"

#include <cmath>
#include <cstddef>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "support/random.hpp"

namespace striper::detail {
namespace {

template <std::size_t kRows>
void expect_is_as_eigen() {
  constexpr auto kSize = static_cast<int>(kRows);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(
        kSize, kSize, [](int, int) { return testing::uniform(-1.0, 1.0); });
    const Eigen::MatrixXd matrix =
        root * root.transpose() + Eigen::MatrixXd::Identity(kSize, kSize);
    typename SmallLdlt<kRows>::Matrix lower;
    typename SmallLdlt<kRows>::Vector right;
    Eigen::VectorXd b(kSize);
    for (std::size_t i = 0; i < kRows; ++i) {
      b[static_cast<int>(i)] = right[i] = testing::uniform(-1.0, 1.0);
      lower[i].fill(std::nan(""));  // The upper triangle does not count.
      for (std::size_t j = 0; j <= i; ++j)
        lower[i][j] = matrix(static_cast<int>(i), static_cast<int>(j));
    }
    const SmallLdlt<kRows> solver(lower);
    ASSERT_TRUE(solver.is_positive());
    const auto found = solver.solve(right);
    const Eigen::VectorXd expected = matrix.llt().solve(b);
    for (std::size_t i = 0; i < kRows; ++i)
      EXPECT_NEAR(found[i], expected[static_cast<int>(i)], 1e-12);
  }
}

TEST(SmallLdlt, SolvesAsEigenDoes) {
  testing::reseed();
  expect_is_as_eigen<1>();
  expect_is_as_eigen<2>();
  expect_is_as_eigen<9>();
}

TEST(SmallLdlt, TellsWhatIsNotPositiveDefinite) {
  using Solver = SmallLdlt<2>;
  EXPECT_TRUE(Solver({{{4.0, 0.0}, {1.0, 1.0}}}).is_positive());
  EXPECT_FALSE(Solver({{{4.0, 0.0}, {2.0, 1.0}}}).is_positive());  // Singular,
  EXPECT_FALSE(Solver({{{1.0, 0.0}, {2.0, 1.0}}}).is_positive());  // and of both signs.
  EXPECT_FALSE(Solver({{{0.0, 0.0}, {0.0, 1.0}}}).is_positive());
  EXPECT_FALSE(Solver({{{std::nan(""), 0.0}, {0.0, 1.0}}}).is_positive());
  EXPECT_FALSE(Solver({{{1.0, 0.0}, {std::nan(""), 1.0}}}).is_positive());
}

}  // namespace
}  // namespace striper::detail
