// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace striper::testing {

/// The random generator of the tests, reseeded with the same number before every test.
inline std::mt19937_64& random_generator() {
  static std::mt19937_64 generator(20021991);
  return generator;
}

inline void reseed(std::uint64_t seed = 20021991) { random_generator().seed(seed); }

/// Uniform in [low, high). Written out so that it gives the same numbers with every standard
/// library.
inline double uniform(double low, double high) {
  return low + (high - low) * static_cast<double>(random_generator()() >> 11) * 0x1.0p-53;
}

/// Standard normal (Box & Muller 1958), the same numbers with every standard library.
inline double normal(double mean = 0.0, double sigma = 1.0) {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(0.0, 1.0)));
  return mean + sigma * radius * std::cos(2.0 * std::numbers::pi * uniform(0.0, 1.0));
}

}  // namespace striper::testing
