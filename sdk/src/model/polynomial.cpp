// SPDX-License-Identifier: Apache-2.0
#include "model/polynomial.hpp"

#include <algorithm>

namespace striper::detail {
namespace {

// Points where a polynomial changes sign, ascending, ended by the limit of the search.
struct Crossings {
  std::array<double, Polynomial::kMaxDegree + 2> at{};
  int count = 0;

  void push(double x) noexcept { at[static_cast<std::size_t>(count++)] = x; }
};

// The last double in [low, high] before the sign changes from that of p(low).
double bisect(const Polynomial& p, double low, double high) noexcept {
  const bool positive = p(low) > 0.0;
  while (true) {
    const double middle = low + 0.5 * (high - low);
    if (!(middle > low && middle < high)) return low;
    if ((p(middle) > 0.0) == positive) {
      low = middle;
    } else {
      high = middle;
    }
  }
}

// Between two neighbouring turning points a polynomial is monotonic: it crosses zero there at most
// once.
Crossings crossings_between(const Polynomial& p, const Crossings& turning, double limit) noexcept {
  Crossings found;
  double low = 0.0;
  for (int i = 0; i <= turning.count; ++i) {
    const double high = i < turning.count ? turning.at[static_cast<std::size_t>(i)] : limit;
    if ((p(low) > 0.0) != (p(high) > 0.0)) found.push(bisect(p, low, high));
    low = high;
  }
  return found;
}

}  // namespace

Polynomial::Polynomial(std::initializer_list<double> coefficients) noexcept {
  std::copy(coefficients.begin(), coefficients.end(), c_.begin());
  degree_ = static_cast<int>(coefficients.size()) - 1;
}

double Polynomial::operator()(double x) const noexcept {
  double value = 0.0;
  for (int i = degree_; i >= 0; --i) value = value * x + c_[static_cast<std::size_t>(i)];
  return value;
}

Polynomial Polynomial::derivative() const noexcept {
  Polynomial result{0.0};
  result.degree_ = std::max(0, degree_ - 1);
  for (std::size_t i = 1; i <= static_cast<std::size_t>(degree_); ++i) {
    result.c_[i - 1] = static_cast<double>(i) * c_[i];
  }
  return result;
}

Polynomial operator+(const Polynomial& a, const Polynomial& b) noexcept {
  Polynomial sum = a;
  sum.degree_ = std::max(a.degree_, b.degree_);
  for (std::size_t i = 0; i < sum.c_.size(); ++i) sum.c_[i] += b.c_[i];
  return sum;
}

Polynomial operator*(const Polynomial& a, const Polynomial& b) noexcept {
  Polynomial product{0.0};
  product.degree_ = std::min(a.degree_ + b.degree_, Polynomial::kMaxDegree);
  for (int i = 0; i <= a.degree_; ++i) {
    for (int j = 0; j <= b.degree_ && i + j <= product.degree_; ++j) {
      product.c_[static_cast<std::size_t>(i) + static_cast<std::size_t>(j)] +=
          a.c_[static_cast<std::size_t>(i)] * b.c_[static_cast<std::size_t>(j)];
    }
  }
  return product;
}

Polynomial operator*(double factor, const Polynomial& a) noexcept { return Polynomial{factor} * a; }

double Polynomial::positive_until(double limit) const noexcept {
  const auto is_not_negative = [](double c) { return c >= 0.0; };
  if (std::all_of(c_.begin(), c_.end(), is_not_negative)) return limit;
  std::array<Polynomial, kMaxDegree + 1> derivatives;
  derivatives[0] = *this;
  for (std::size_t i = 1; i <= static_cast<std::size_t>(degree_); ++i) {
    derivatives[i] = derivatives[i - 1].derivative();
  }
  Crossings crossings;
  for (int i = degree_; i >= 0; --i) {
    crossings = crossings_between(derivatives[static_cast<std::size_t>(i)], crossings, limit);
  }
  return crossings.count > 0 ? crossings.at[0] : limit;
}

}  // namespace striper::detail
