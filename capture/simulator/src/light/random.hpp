// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace striper::detail {

/// Natural logarithm of a positive normal number to about 1e-15, plain arithmetic.
double plain_log(double x) noexcept;

/// Exponential function to about 1e-15 for |x| below 700, plain arithmetic.
double plain_exp(double x) noexcept;

/// Where the standard normal distribution function is p, 0 < p < 1, to about 1e-15 of its value:
/// the rational functions of Wichura, algorithm AS 241 (1988), plain arithmetic.
double normal_quantile(double p) noexcept;

/// Random numbers that depend on nothing but the key: every pixel of every exposure has its own
/// stream, so that images can be rendered in any order and in part.
///
/// SplitMix64 (Steele, Lea & Flood 2014) from a hashed start. The distributions use plain
/// arithmetic and IEEE square roots only, no library functions, so they give the same numbers on
/// every machine.
class PixelRandom {
 public:
  PixelRandom(std::uint64_t seed, std::uint64_t purpose, std::uint64_t exposure,
              std::uint64_t pixel) noexcept
      : PixelRandom(mix(mix(seed + kStep * (purpose + 1)) ^ exposure), pixel) {}

  std::uint64_t bits() noexcept { return mix(state_ += kStep); }

  /// Uniform in (0, 1): the middle of one of 2^53 cells.
  double uniform() noexcept { return (static_cast<double>(bits() >> 11) + 0.5) * 0x1.0p-53; }

  /// Standard normal, by inversion of its distribution function.
  double normal() noexcept { return normal_quantile(uniform()); }

  /// Poisson: inversion below a mean of 10, Hoermann's transformed rejection PTRS (1993) above.
  double poisson(double mean) noexcept;

  /// The finalizer of SplitMix64: every bit of the result depends on every bit of `z`.
  static std::uint64_t mix(std::uint64_t z) noexcept {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31);
  }

 private:
  friend class RandomPixels;
  static constexpr std::uint64_t kStep = 0x9E3779B97F4A7C15ULL;

  PixelRandom(std::uint64_t exposure_key, std::uint64_t pixel) noexcept
      : state_(mix(exposure_key ^ pixel)) {}

  std::uint64_t state_;
};

/// The streams of all pixels of one exposure: the same numbers as PixelRandom's own, begun faster.
class RandomPixels {
 public:
  RandomPixels(std::uint64_t seed, std::uint64_t purpose, std::uint64_t exposure) noexcept
      : exposure_key_(PixelRandom::mix(PixelRandom::mix(seed + PixelRandom::kStep * (purpose + 1)) ^
                                       exposure)) {}

  PixelRandom of(std::uint64_t pixel) const noexcept { return {exposure_key_, pixel}; }

 private:
  std::uint64_t exposure_key_;
};

}  // namespace striper::detail
