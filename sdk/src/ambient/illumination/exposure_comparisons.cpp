// SPDX-License-Identifier: Apache-2.0
#include "ambient/illumination/exposure_comparisons.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

#include <opencv2/core.hpp>

#include "ambient/pixels/line_path.hpp"

namespace striper::detail {
namespace {

// Further apart the scene may have moved on.
constexpr std::uint64_t kFarthestInTriple = 3;

}  // namespace

void ExposureComparisons::clear() noexcept {
  count_ = 0;
  in_triples_ = 0;
  pairs_.clear();
  triples_.clear();
}

void ExposureComparisons::add(const Frame& exposure, std::uint64_t number) {
  if (count_ == pool_.size()) pool_.emplace_back();
  ProfiledExposure* added = &pool_[count_];
  added->number = number;
  added->exposures_per_picture = exposure.exposures_per_picture;
  added->parity = exposure.field == Field::kBottom ? 1 : 0;
  search_.profile(exposure, axis_, added->bands);
  if (count_ > 0) {
    const cv::Size had = pool_.front().bands.plain.size();
    const cv::Size has = added->bands.plain.size();
    // Of the two fields of an odd number of rows one is a row longer.
    if (has.height != had.height || std::abs(has.width - had.width) > 1) {
      std::swap(pool_.front(), *added);
      clear();
      added = &pool_.front();
    }
  }
  const bool columns = axis_ == StripeAxis::kColumns;
  bands_ = added->bands.plain.rows / exposure.image.channels();
  most_jump_ = LinePath::most_jump(columns ? exposure.image.cols : exposure.image.rows, bands_);
  pairs_.resize(pairs_.size() + count_);
  ++count_;
}

void ExposureComparisons::compare_triples() {
  for (; in_triples_ < count_; ++in_triples_) add_triples_before(in_triples_);
}

void ExposureComparisons::add_triples_before(std::size_t after) {
  const auto is_near = [this](std::size_t i, std::size_t j) {
    return pool_[j].number - pool_[i].number <= kFarthestInTriple;
  };
  for (std::size_t middle = after; middle-- > 0 && is_near(middle, after);) {
    for (std::size_t before = middle; before-- > 0 && is_near(before, middle);) {
      triples_.push_back(triple(before, middle, after));
    }
  }
}

Triple ExposureComparisons::triple(std::size_t before, std::size_t middle, std::size_t after) {
  const double forth = strength(std::array{over(middle, before), over(middle, after)});
  const double back = strength(std::array{over(before, middle), over(after, middle)});
  const auto span = static_cast<double>(pool_[after].number - pool_[before].number);
  return {pool_[before].number, pool_[middle].number, pool_[after].number, forth - back,
          1.0 / (span * span)};
}

std::span<const Surplus> ExposureComparisons::pairs(std::uint64_t farthest) {
  surpluses_.clear();
  for (std::size_t i = 0; i < count_; ++i) {
    for (std::size_t j = i + 1; j < count_; ++j) {
      const std::uint64_t apart = pool_[j].number - pool_[i].number;
      if (apart > farthest) break;
      const Strength strength = of_pair(i, j);
      // The longer between them, the less of the scene is the same.
      const double weight = 1.0 / static_cast<double>(apart * apart);
      surpluses_.push_back(
          {pool_[i].number, pool_[j].number, strength.forth - strength.back, weight});
    }
  }
  return surpluses_;
}

ExposureComparisons::Strength ExposureComparisons::of_pair(std::size_t i, std::size_t j) {
  if (i > j) {
    const Strength turned = of_pair(j, i);
    return {turned.back, turned.forth};
  }
  std::optional<Strength>& known = pair(i, j).strength;
  if (!known) known = Strength{strength(std::array{over(i, j)}), strength(std::array{over(j, i)})};
  return *known;
}

double ExposureComparisons::alone(std::size_t i) {
  const BandProfiles& bands = pool_[i].bands;
  nothing_.plain.create(bands.plain.size(), CV_32F);
  set_to_zero(nothing_.plain);
  nothing_.smooth = nothing_.side = nothing_.plain;
  return strength(
      std::array{ProfilePair{bands, nothing_, false, search_.noise_of(bands, nothing_)}});
}

ProfilePair ExposureComparisons::over(std::size_t i, std::size_t j) {
  const bool is_interpolated = pool_[i].parity != pool_[j].parity;
  return {pool_[i].bands, pool_[j].bands, is_interpolated, noise_of(i, j)};
}

float ExposureComparisons::noise_of(std::size_t i, std::size_t j) {
  std::optional<float>& known = pair(std::min(i, j), std::max(i, j)).noise;
  if (!known) known = search_.noise_of(pool_[i].bands, pool_[j].bands);
  return *known;
}

double ExposureComparisons::strength(std::span<const ProfilePair> pairs) {
  return search_.strength(pairs, bands_, most_jump_) / LinePath::kClear;
}

}  // namespace striper::detail
