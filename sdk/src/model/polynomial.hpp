// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <initializer_list>

namespace striper::detail {

/// A polynomial of degree at most 20: enough for the fold of every lens model. Value; no
/// allocation.
class Polynomial {
 public:
  static constexpr int kMaxDegree = 20;

  /// Coefficients from the constant term up.
  Polynomial() noexcept = default;
  Polynomial(std::initializer_list<double> coefficients) noexcept;

  double operator()(double x) const noexcept;
  Polynomial derivative() const noexcept;

  friend Polynomial operator+(const Polynomial& a, const Polynomial& b) noexcept;
  friend Polynomial operator*(const Polynomial& a, const Polynomial& b) noexcept;
  friend Polynomial operator*(double factor, const Polynomial& a) noexcept;

  /// Returns the largest x in [0, limit] such that the polynomial, positive at 0, stays positive up
  /// to x: just below its first root, to the last bit, or `limit` where there is none. A root where
  /// the sign does not change does not count. Cost: about 2 us for degree 3, 100 us for degree 20.
  double positive_until(double limit) const noexcept;

 private:
  std::array<double, kMaxDegree + 1> c_{};
  int degree_ = 0;
};

}  // namespace striper::detail
