// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <striper/core/frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "ambient/illumination/pattern_fits.hpp"
#include "ambient/pixels/band_profiles.hpp"

namespace striper::detail {

/// What is kept of an exposure to compare it with others.
struct ProfiledExposure {
  std::uint64_t number = 0;
  int exposures_per_picture = 1;
  int parity = 0;  ///< 1: the bottom field.
  BandProfiles bands;
};

/// The exposures of one look at the images, and how much of a stripe each shows over others.
///
/// Nothing is compared twice, and what is asked of every look can be compared as the exposures
/// come. No allocation after the first look at images of a size. Not thread-safe.
class ExposureComparisons {
 public:
  /// Of a stripe, as a fraction of what a clear one gives.
  struct Strength {
    double forth = 0.0;  ///< In the first over the second.
    double back = 0.0;
  };

  explicit ExposureComparisons(StripeAxis axis) : axis_(axis) {}

  void clear() noexcept;

  /// Adds an exposure; one of another size than those before is of another stream, and the first.
  void add(const Frame& exposure, std::uint64_t number);

  /// In the order in which they came.
  std::span<const ProfiledExposure> exposures() const noexcept { return {pool_.data(), count_}; }

  /// Compares what was not yet with what came before it in threes.
  void compare_triples();
  /// All threes of neighbouring exposures. Precondition: they are compared.
  std::span<const Triple> triples() const noexcept { return triples_; }

  /// All twos that are no more than so many exposures apart; valid until the next call.
  std::span<const Surplus> pairs(std::uint64_t farthest);

  /// Compares exposures i and j.
  Strength of_pair(std::size_t i, std::size_t j);

  /// How strongly exposure i shows a stripe by itself.
  double alone(std::size_t i);

  /// The variance of white noise in the difference of the plain profiles of i and j.
  double white_variance_of(std::size_t i, std::size_t j) {
    return search_.white_variance_of_difference(pool_[i].bands.plain, pool_[j].bands.plain);
  }

 private:
  struct Pair {
    std::optional<float> noise;
    std::optional<Strength> strength;
  };
  // The first of the two came first.
  Pair& pair(std::size_t i, std::size_t j) { return pairs_[j * (j - 1) / 2 + i]; }
  float noise_of(std::size_t i, std::size_t j);
  ProfilePair over(std::size_t i, std::size_t j);
  double strength(std::span<const ProfilePair> pairs);
  Triple triple(std::size_t before, std::size_t middle, std::size_t after);
  void add_triples_before(std::size_t after);

  StripeAxis axis_;
  int bands_ = 0;
  int most_jump_ = 0;
  LineSearch search_;
  std::vector<ProfiledExposure> pool_;  // The first `count_` of them.
  std::size_t count_ = 0;
  std::vector<Pair> pairs_;
  std::vector<Surplus> surpluses_;
  std::vector<Triple> triples_;
  std::size_t in_triples_ = 0;
  BandProfiles nothing_;
};

}  // namespace striper::detail
