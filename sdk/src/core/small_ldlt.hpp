// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace striper::detail {

/// L D L^T of a symmetric positive definite matrix of a few rows, without pivots, all loops
/// unrolled. Of 9 rows factors and solution take .1 us; Eigen's LLT, which treats its blocks as of
/// any size, .37.
template <std::size_t kRows>
class SmallLdlt {
 public:
  using Vector = std::array<double, kRows>;
  using Matrix = std::array<Vector, kRows>;  ///< [row][column], of which the lower triangle counts.

  explicit SmallLdlt(const Matrix& matrix) noexcept {
#pragma GCC unroll 16
    for (std::size_t k = 0; k < kRows; ++k)
#pragma GCC unroll 16
      for (std::size_t i = k; i < kRows; ++i) column_[k][i] = matrix[i][k];
#pragma GCC unroll 16
    for (std::size_t k = 0; k < kRows; ++k) eliminate(k);
  }

  /// NaN and what overflows count as not positive.
  bool is_positive() const noexcept { return is_positive_; }

  Vector solve(Vector right) const noexcept {
#pragma GCC unroll 16
    for (std::size_t k = 0; k < kRows; ++k)
#pragma GCC unroll 16
      for (std::size_t i = k + 1; i < kRows; ++i) right[i] -= column_[k][i] * right[k];
#pragma GCC unroll 16
    for (std::size_t k = 0; k < kRows; ++k) right[k] *= per_pivot_[k];
#pragma GCC unroll 16
    for (std::size_t n = 1; n <= kRows; ++n)
#pragma GCC unroll 16
      for (std::size_t i = 0; i < kRows - n; ++i)
        right[i] -= column_[i][kRows - n] * right[kRows - n];
    return right;
  }

 private:
  void eliminate(std::size_t k) noexcept {
    Vector& of = column_[k];
    is_positive_ = is_positive_ && std::isnormal(of[k]) && of[k] > 0.0;
    per_pivot_[k] = 1.0 / of[k];
#pragma GCC unroll 16
    for (std::size_t j = k + 1; j < kRows; ++j) {
      const double factor = of[j] * per_pivot_[k];
#pragma GCC unroll 16
      for (std::size_t i = j; i < kRows; ++i) column_[j][i] -= factor * of[i];
    }
#pragma GCC unroll 16
    for (std::size_t i = k + 1; i < kRows; ++i) of[i] *= per_pivot_[k];
  }

  static_assert(kRows <= 16, "as far as loops are unrolled");

  Matrix column_{};  // L's, below its diagonal of ones.
  Vector per_pivot_;
  bool is_positive_ = true;
};

}  // namespace striper::detail
